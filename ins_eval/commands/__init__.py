"""What the command line can be asked to do, one file a verb; each is a function that returns an exit code."""
