"""Grey-box models: a linear plant of low order, with effects of the catalogue, fitted by simulation error."""
