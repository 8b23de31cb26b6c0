"""Fitted models for other people's simulators, each with a record and the answer that is expected of it."""
