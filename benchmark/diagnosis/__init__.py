"""What a simulation gets wrong, and what physical cause explains it."""
