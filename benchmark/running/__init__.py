"""Runs: suites of jobs, each in a process of its own, on the engines."""
