"""Views of a simulation error: what the error of a free run depends on, and how sure that is."""
