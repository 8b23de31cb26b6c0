"""Data sets: `load`, `fetch`, `save` or `describe` one; importing this costs no pandas and no scipy."""

from simgap.data.formats.writing import save
from simgap.data.loading import Reading, load, read
from simgap.data.measured.fetching import available, card, fetch
from simgap.data.measured.locations import Missing
from simgap.data.summary import describe

__all__ = ["Missing", "Reading", "available", "card", "describe", "fetch", "load", "read", "save"]
