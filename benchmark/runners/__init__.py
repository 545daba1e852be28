"""`python -m benchmark.runners.NAME`: make cases, have them answered by the tool, count, report."""
