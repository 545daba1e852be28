"""What the equations and numbers of Paper B give when they are computed again, from nothing but the paper itself.

    pendulum.py      eqs (1)-(3)                                            B1, B2
    bridge.py        eqs (4)-(6), (16), (17)                                B3-B5
    estimation.py    Tables 3 and 4, what their residuals are               B8-B11, B20
    output.py        193 and 24 ug, eq. (31), the closure with Table 4      B12-B14, B21
    loop.py          eqs (13), (24)-(28): what each test can see            B15, B16
    electronics.py   steps of DA0, gain of a resistor, approximations       B17, B22
    wording.py       symbols, references, shares, Table 2                   B6, B7, B18, B19

Every function returns numbers; what they mean for a row of the page is said in `rows`.
"""
