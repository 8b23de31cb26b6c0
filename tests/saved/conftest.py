"""The fixture of the small data set."""

from small_data import dataset  # noqa: F401
