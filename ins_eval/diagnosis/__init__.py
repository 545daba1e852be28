"""Where a recording leaves its simulation: what is believed is navigated, and what is left over is judged.

    estimate/  a recording made ready (`case`), whitened, its noise fitted, sets of effects searched, the best of them
               navigated with (`refine`)
    unnamed/   what has no name: which channel, when, and how sure, with every channel and interval searched
    answer/    what was found (`findings`), the verdict over it (`decision`), rivals, experiments, the written answer
    policy     every threshold that decides

A module imports from rooms above its own in this list, and from none below. What it needs for annotations only it
imports for type checkers only.

The residual y is INS minus what was measured. Under a hypothesis with parameters p it is

    y = X p + H x + v,    x' = F x + G w

where x is what process noise w makes of the navigation error, v the noise of the receiver, and X holds the response
of the error model to each sensor error, start error and receiver error. The same filter whitens y and X; then all
questions are least squares on A = X'X and b = X'y.

Sources: Harvey and Koopman, J. Bus. Econ. Stat. 10 (1992) 377; de Jong and Penzer, J. Am. Stat. Assoc. 93 (1998) 796
(columns through the filter); Willsky and Jones, IEEE Trans. Autom. Control 21 (1976) 108 (the columns are the failure
signatures of their generalised likelihood ratio).
"""
