"""simgap: classical and neural system identification on one bench, by free-run simulation."""

__version__ = "0.1.0"
