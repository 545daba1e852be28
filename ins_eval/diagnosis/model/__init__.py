"""What is believed, and how every error that has a name would show beside it."""
