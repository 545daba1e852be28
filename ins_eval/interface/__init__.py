"""What is asked for in a notebook or on the command line, a module a question: each function gives a `Result`.

import ins_eval as ie
recording = ie.read("my_recording")
result = ie.evaluate(recording)
result.to_frame()
result.plot("position_error")
"""
