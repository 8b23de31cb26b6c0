"""What a machine did before its records begin: a piece of a run is not a run that starts there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from simgap.records import LONGEST_PAST, Experiment


@dataclass(frozen=True, eq=False)
class Past:
    """For how long the machine had run before each record, and its last inputs, the newest last.

    Where fewer of them are known than of another record, the earliest known one stood before; where none is, the first
    of the record did.
    """

    since: Float[np.ndarray, " E"]  # s
    u: Float[np.ndarray, "E P nu"]

    @classmethod
    def none(cls, u: Float[np.ndarray, "E T nu"], samples: int = 0) -> Past:
        """Of records with these inputs that begin where their runs do; so long before, the first of them stood."""
        return cls(np.zeros(len(u)), np.repeat(u[:, :1], samples, axis=1))

    @classmethod
    def of(cls, experiments: Sequence[Experiment]) -> Past:
        """Take what these experiments know of theirs."""
        longest = max(len(x.before) for x in experiments)

        def padded(x: Experiment) -> np.ndarray:
            first = (x.before if len(x.before) else x.u)[:1]
            return np.concatenate((np.repeat(first, longest - len(x.before), axis=0), x.before))

        return cls(np.array([x.since for x in experiments]), np.stack([padded(x) for x in experiments]))

    def only(self, experiments: np.ndarray) -> Past:
        """Return that of some of the records."""
        return Past(self.since[experiments], self.u[experiments])

    def at(self, starts: Int64[np.ndarray, " S"], u: Float[np.ndarray, "E T nu"], dt: float) -> Past:
        """Return that of pieces [E * S] of the records with inputs u that begin at these samples, 0 being the first."""
        known, last = self.u.shape[1], int(starts.max(initial=0))
        run = np.concatenate((self.u, u[:, :last]), axis=1)
        length = min(LONGEST_PAST, known + last)
        rows = known + starts[:, None] - length + np.arange(length)
        inputs = run[:, np.maximum(rows, 0)]  # [E, S, length, nu]
        since = self.since[:, None] + dt * starts
        return Past(since.ravel(), inputs.reshape(since.size, length, u.shape[2]))

    def beside(self, other: Past) -> Past:
        """Return that of these records followed by others, of which as much is told."""
        return Past(np.concatenate((self.since, other.since)), np.concatenate((self.u, other.u)))
