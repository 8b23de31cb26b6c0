"""Simulated test rigs with one or two physical effects hidden in them, to try a diagnosis on.

Whoever diagnoses gets what a measurement would give: inputs, noisy outputs, units. What was hidden is written
here from the physics, integrated at a fine step, and shares no code with the effects that a diagnosis knows.
"""

from simgap.data.simulated.rigs.effects import CATALOGUE, OUTSIDE, physical, suitable
from simgap.data.simulated.rigs.plants import RIGS
from simgap.data.simulated.rigs.recordings import hide

__all__ = ["CATALOGUE", "OUTSIDE", "RIGS", "hide", "physical", "suitable"]
