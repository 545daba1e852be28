"""Where a recording leaves its simulation: what is believed is navigated, and what is left over is judged.

    unnamed/   what has no name: which channel, when, and how sure, with every channel and interval searched
    answer/    what is found (`collect`), the verdict over it (`decision`), rivals, experiments, the written answer

A module of `answer` imports from `unnamed`, and both from `estimation`, `error_model` and `policy`, none of which
imports them. What a module needs for annotations only it imports for type checkers only.
"""
