"""The fixtures of the small data set and of the example models."""

from small_data import dataset, example, folder  # noqa: F401
