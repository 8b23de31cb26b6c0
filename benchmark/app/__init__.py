"""The page that `simgap open` shows: a record, what it is, its diagnosis, and the model to take away."""
