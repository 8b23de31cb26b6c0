"""Data sets: `load`, `fetch`, `save` or `describe` one; importing this costs no pandas and no scipy."""

from simgap.data.fetching import available, card, fetch
from simgap.data.loading import load
from simgap.data.locations import Missing
from simgap.data.summary import describe
from simgap.data.writing import save

__all__ = ["Missing", "available", "card", "describe", "fetch", "load", "save"]
