"""Paper A (Sensors 2021, 21, 294) statement by statement: printed, computed again from its own numbers, and ours.

printed.toml      the numbers that it prints (those that the simulation needs, too, stand there)
stated.toml       what it states and nothing here computes or tests
audit/            what its numbers imply of one another
ours.py           small simulations that only this page needs
single.py         single flights, which a published flight has to be held against
paired.py         changes and ratios of the same instruments, which a claim about a change is tested by
rows/             all rows, by tables, equations, procedures, figures, claims and inconsistencies
figures.py        its figures of the laboratory; oven_figures.py, of the oven; rigs.py, drawings of its three rigs
words.py          the rows and the figures as a page

A row, its verdict and the rule of the verdicts stand in ``ins_eval.studies.papers``.
"""
