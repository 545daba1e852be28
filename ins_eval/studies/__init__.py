"""Studies of two papers: each of their statements beside what its own numbers give and beside ours.

paper_a, paper_b  what a paper prints, what its numbers imply, our side of it, its rows, words and figures
papers            a row, its verdict and the rule of the verdicts
statements        rows in words: counted, grouped, and put beside their figures
diagrams          the parts of a block diagram
paper_report, loop_report  the two commands

Nothing but the command line imports from here; what a paper says that others need stands below them
(`published_flight`, `datasheets`, the presets).
"""
