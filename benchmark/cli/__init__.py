"""The command line. One file per group of commands; what is slow to import is imported inside a command."""

from simgap.cli.application import main

__all__ = ["main"]
