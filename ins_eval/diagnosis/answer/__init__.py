"""From findings to a verdict, and all that is said with it."""
