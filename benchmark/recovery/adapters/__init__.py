"""Tools that answer the cases of the recovery benchmark; a new one is one new file with one decorator."""
