"""Recordings of another world: its Earth, paths, heat, instruments, effects, receivers; nothing of the tool is used."""
