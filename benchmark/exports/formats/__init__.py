"""The formats of `simgap export`, one file each; the README of exports says what a file holds."""
