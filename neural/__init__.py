"""Neural models, one file each, found by their decorator; none yet."""
