"""Disturbances that no effect of the vocabulary describes: where, when, how sure."""
