"""Public measured data sets: where they lie and how they are read."""
