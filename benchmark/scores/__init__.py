"""What an answer is counted for, and how well one who knows the noise would answer."""
