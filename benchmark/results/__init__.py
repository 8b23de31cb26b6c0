"""Results: the store of rows, and the comparison of two stores."""
