"""What is asked of recordings and simulations, one file a question, each with a frozen result."""
