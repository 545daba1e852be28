"""Where a recording leaves its simulation: what is believed is navigated, and what is left over is judged.

    null        the belief through the full mechanization, against everything that was measured
    error_model how a small error of sensors, start or equations grows: linear, one transition an epoch
    drives      what could drive it, integrated at the sample rate
    columns     a hypothesis as a column of the regression; `library` lists those of the vocabulary
    whitening   one Kalman pass that makes the residual white, and every column with it
    noise       levels and correlation of all noise, estimated with the answer, under one prior
    evidence    Bayes factors of columns, everything uncertain marginalised
    locate      which channel, when, and how sure after having looked everywhere
    open_form   a channel that changes slowly, with time or with temperature, and has no name; `motion_dependence`: with
                the motion
    adequacy    what such a channel gains instead of an explanation and beside it
    answer      the verdict in the form `ins-diagnosis/1`

The residual y is INS minus what was measured. Under a hypothesis with parameters p it is

    y = X p + H x + v,    x' = F x + G w

where x is what process noise w makes of the navigation error, v the noise of the receiver, and X holds the response
of the error model to each sensor error, start error and receiver error. The same filter whitens y and X; then all
questions are least squares on A = X'X and b = X'y.

Sources: Harvey and Koopman, J. Bus. Econ. Stat. 10 (1992) 377; de Jong and Penzer, J. Am. Stat. Assoc. 93 (1998) 796
(columns through the filter); Willsky and Jones, IEEE Trans. Autom. Control 21 (1976) 108 (the columns are the failure
signatures of their generalised likelihood ratio).
"""
