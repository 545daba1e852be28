"""Paper B (IEEE Access 2019) statement by statement: printed, computed again from its own numbers, and ours.

printed.toml      the numbers that it prints
audit/            what its numbers and equations imply of one another
rows              all rows, by tables, modules, equations, procedure, figures, claims and inconsistencies

A row, its verdict and the rule of the verdicts stand in ``ins_eval.papers``.
"""
