"""Paper A (Sensors 2021, 21, 294) statement by statement: printed, computed again from its own numbers, and ours.

printed.toml      the numbers that it prints (those that the simulation needs, too, stand there)
audit/            what its numbers imply of one another
ours.py           small simulations that only this page needs
single.py         single flights, which a published flight has to be held against
paired.py         changes and ratios of the same instruments, which a claim about a change is tested by
rows/             all rows, by tables, equations, procedures, figures, claims and inconsistencies: words in TOML,
                  values beside them
figures.py        its figures of the laboratory; oven_figures.py, of the oven
diagrams.toml     its drawings: see ins_eval.studies.diagrams; pictures.toml, what to see in each figure
words.py          the rows and the figures as a page

A row, its verdict and the rule of the verdicts stand in ``ins_eval.studies.papers``, how a row is made of a table in
``ins_eval.studies.row_tables``.
"""
