"""Fitted models on disk: one file for each, from which it simulates as before."""
