"""Paper B (IEEE Access 2019) statement by statement: printed, computed again from its own numbers, and ours.

printed.toml      the numbers that it prints
audit/            what its numbers and equations imply of one another
ours.py           what our loop gives, with attraction.py, temperature.py and in_flight.py
rows/             all rows, by tables, modules, equations, procedure, figures, studies, claims and inconsistencies:
                  words in TOML, values beside them
figures.py        its figures and our distributions beside its tables
diagrams.toml     its drawings: see ins_eval.studies.diagrams; pictures.toml, what to see in each figure
words.py          the rows and the figures as a page

A row, its verdict and the rule of the verdicts stand in ``ins_eval.studies.papers``, how a row is made of a table in
``ins_eval.studies.row_tables``.
"""
