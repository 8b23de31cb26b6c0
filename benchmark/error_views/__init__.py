"""The error of a free run, seen the ways a control engineer looks at it."""
