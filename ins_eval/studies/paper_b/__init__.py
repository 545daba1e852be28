"""Paper B (IEEE Access 2019) statement by statement: printed, computed again from its own numbers, and ours.

printed.toml      the numbers that it prints
stated.toml       what it states and nothing here computes or tests
audit/            what its numbers and equations imply of one another
ours.py           what our loop gives, with attraction.py, temperature.py and in_flight.py
rows/             all rows, by tables, modules, equations, procedure, figures, claims and inconsistencies
figures.py        its figures and our distributions beside its tables; loop_diagrams.py, drawings of its loop
words.py          the rows and the figures as a page

A row, its verdict and the rule of the verdicts stand in ``ins_eval.studies.papers``.
"""
