"""Simulated machines whose truth is known."""
