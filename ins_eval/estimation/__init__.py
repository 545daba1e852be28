"""Recordings made ready, their noise, and the sets of effects that explain them.

    case, arcs, chamber      a recording made ready: navigated as believed, its residual and columns
    whitening, coarse, blocks, slope   the filter through which both go, on blocks, and its derivatives by the noise
    noise, noise_fit, receiver_jumps   the noise of the sensors and the receiver
    evidence, search, study  how probable a set of effects is, and the most probable sets
    clock_starts             clocks far apart, brought together before a search
    refine, placing          the best of them navigated with
    linearisation, best_set  a search around a refined set, and searches in turn until the set stays
    held_out, scatter, instants, forecast   how it does on data not used, over stretches, at instants, in other flights
    description, stated_start   what is wrong in how a recording and its start are described

The residual y is INS minus what was measured. Under a hypothesis with parameters p it is

    y = X p + H x + v,    x' = F x + G w

where x is what process noise w makes of the navigation error, v the noise of the receiver, and X holds the response
of the error model to each sensor error, start error and receiver error. The same filter whitens y and X; then all
questions are least squares on A = X'X and b = X'y.

Sources: Harvey and Koopman, J. Bus. Econ. Stat. 10 (1992) 377; de Jong and Penzer, J. Am. Stat. Assoc. 93 (1998) 796
(columns through the filter); Willsky and Jones, IEEE Trans. Autom. Control 21 (1976) 108 (the columns are the failure
signatures of their generalised likelihood ratio).
"""
