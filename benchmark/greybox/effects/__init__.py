"""The catalogue of physical effects: one file each, the file's name is the effect's name."""
