"""What the numbers of Paper A give when they are computed again, from nothing but the paper itself.

    epoxy.py          Tables 2 and 3 and the creep experiment               A1-A5
    scale_factor.py   eqs (6)-(17) and Table 4                              A6, A10, A12-A17, A28
    chamber.py        the four positions and the programme of the chamber   A7-A9, A11, A18
    navigation.py     oven and flight: rates of temperature, percentages, durations, CEP   A19-A24, A26, A29, A30
    devices.py        Tables 1 and 5                                        A25, A27

Every function returns numbers; what they mean for a row of the page is said in `rows`.
"""
