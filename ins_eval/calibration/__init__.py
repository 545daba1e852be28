"""From readings in a thermal chamber to the curves of an accelerometer.

`four_point` turns the readings of four positions into scale factor and bias against temperature and its rate;
`fits` and `branches` draw curves through them. A curve is any object with
``evaluate(temperature_c, rate_c_per_min) -> (n,)``. Nothing here knows how the readings came about.
"""
