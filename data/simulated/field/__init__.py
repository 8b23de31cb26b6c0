"""Simulated machines as they stand in the field, each with constants drawn from its seed.

Closed loops, an axis without a spring, a flexible joint, a pendulum, two inputs, a valve before a slow process. They
are integrated at a fine step and share no code with the effects that a diagnosis knows.
"""

from simgap.data.simulated.field.machines import RIGS
from simgap.data.simulated.field.recordings import hide
from simgap.data.simulated.field.sizes import suitable

__all__ = ["RIGS", "hide", "suitable"]
