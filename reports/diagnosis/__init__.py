"""A diagnosis as a text and as a page."""
