"""An effect where it acts, and the sizes of the signals there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from simgap.greybox.effects.effect import Effect
from simgap.greybox.effects.scales import SignalScales
from simgap.greybox.samples import OFFSET


@dataclass(frozen=True)
class Term:
    """An effect where it acts: on which input, or on which output; `late`, where its signal may pass it later."""

    effect: Effect
    channel: int = 0
    late: bool = field(default=False, compare=False)

    @property
    def place(self) -> int:
        """Where in the chain of effects a signal passes this one."""
        late = self.effect.late_place if self.late else None
        return self.effect.place_in_chain if late is None else late

    @property
    def key(self) -> tuple[str, int]:
        """Name and channel; a model has each term once."""
        return self.effect.name, self.channel

    @property
    def in_loop(self) -> bool:
        """Whether the compiled loop works it out, as a force by the state of the plant."""
        return self.effect.port == "force" and not self.effect.own

    def replaces(self, other: Term) -> bool:
        """Tell whether this effect contains the other one as a special case."""
        return other.effect.name in self.effect.contains


def in_each_order(terms: Sequence[Term]) -> list[list[Term]]:
    """List the terms as they are, and with each later or earlier in its chain where others stand in between."""
    orders = [list(terms)]
    for i, term in enumerate(terms):
        moved = replace(term, late=not term.late)
        first, last = sorted((term.place, moved.place))
        chain = [t for t in terms if (t.effect.port, t.channel) == (term.effect.port, term.channel)]
        if any(first < other.place < last for other in chain):
            orders.append([*terms[:i], moved, *terms[i + 1 :]])
    return orders


@dataclass(frozen=True, eq=False)
class PlantScales:
    """Signal scales at each input and at each output; forces see those of the first of both."""

    inputs: tuple[SignalScales, ...]
    outputs: tuple[SignalScales, ...]
    fastest: float = math.inf  # 1/s, of the poles of the plain model

    @property
    def output_sizes(self) -> Float[np.ndarray, " ny"]:
        """Sizes of the outputs, as `Records.sizes` of the readings that the scales were measured on."""
        sizes = [max(s.y_rms, OFFSET * max(abs(s.y_low), abs(s.y_high))) or 1.0 for s in self.outputs]
        return np.array(sizes)

    def of(self, term: Term) -> SignalScales:
        """Return the scales where a term acts."""
        port = term.effect.port
        return self.inputs[term.channel] if port == "input" else self.outputs[term.channel if port == "output" else 0]
