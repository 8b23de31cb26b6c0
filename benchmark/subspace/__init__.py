"""Linear state-space models from projections of measured signals."""
