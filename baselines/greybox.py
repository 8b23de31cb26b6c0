"""A linear plant with chosen physical effects, fitted to the simulation error."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field

from simgap.greybox.additions import add
from simgap.greybox.baseline import Baseline
from simgap.greybox.effects.effect import Effect, InputEffect
from simgap.greybox.fitting import Estimate
from simgap.greybox.linear import find_baseline
from simgap.greybox.machine_baseline import find_machine_baseline
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.plant import Plant
from simgap.greybox.position_and_velocity import plants_of
from simgap.greybox.refits import from_other_poles
from simgap.greybox.terms import Term
from simgap.records import Channel, TrainingSet, UnusableInput
from simgap.registry import EFFECTS, MODELS


@MODELS.register("greybox")
@dataclass
class GreyBox(GreyBoxModel):
    """x' = A x + B (u' + f), y = C x: low order, with effects of the catalogue on input, force or output.

    Order 1 for a velocity, 2 for a position, else what held-out data ask for up to 8; fitted by simulation error
    (Ljung 1999, section 4.2) from several starts, with the start state of every experiment estimated along.
    effects: names of `simgap list effects`, or one of them, "name:channel" where an effect can sit on several channels.
    """

    plants: list[FittedPlant] = field(default_factory=list, init=False, repr=False)
    effects: Sequence[str] = ()

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Fit the plain model, then add the effects one by one in the given order; nothing here is random."""
        data = data.as_runs()  # a simulation is given inputs and first outputs, and not the time
        chosen: list[tuple[Estimate, Baseline]] = []
        named = [self.effects] if isinstance(self.effects, str) else self.effects
        placed = [_place(name, data) for name in named]
        for outputs in plants_of(data, data.channels):
            find = find_baseline if data.channels.plant is None else find_machine_baseline
            baseline = find(data.train, data.valid, data.channels, outputs, data.n_init)
            estimate = baseline.estimate
            for effect, plant, channel in placed:
                # What is not simulated is left out of the records by the baseline itself.
                if effect.simulated and (plant is None or plant == outputs):
                    _check_that_it_acts(Term(effect, channel), estimate.plant)
                    larger = add(baseline, estimate, Term(effect, channel))
                    estimate = from_other_poles(baseline, estimate, larger)
            chosen.append((estimate, baseline))
        self._chosen, self._train = tuple(chosen), data.train
        self.plants = [FittedPlant.fit(*found, data.train + data.valid) for found in chosen]

    def as_chosen(self) -> GreyBox:
        """Return the same plants and effects, fitted to the training data alone."""
        alone = copy.copy(self)
        alone.plants = [FittedPlant.fit(*found, self._train) for found in self._chosen]
        return alone


def _check_that_it_acts(term: Term, plant: Plant) -> None:
    """Raise UnusableInput for an effect that changes nothing on such a plant, or has nowhere to begin."""
    assert plant.scales is not None
    if not term.effect.suits(plant.scales.of(term)):
        what = {"other": "an output of no known kind"}.get(plant.kind, f"a {plant.kind}")
        raise UnusableInput(f"{term.effect.name} does not act on {what} of order {plant.order} in these records; "
                            "leave it out, or say with kind what the output is")  # fmt: skip


def _place(name: str, data: TrainingSet) -> tuple[Effect, tuple[int, ...] | None, int]:
    """Find the effect, the plant it belongs to (None: any), and its channel there. Raises UnusableInput."""
    name, _, channel = name.partition(":")
    effect = EFFECTS[name]()
    inputs, outputs = data.channels.inputs, data.channels.outputs
    known = data.channels.plant
    if not channel and isinstance(effect, InputEffect) and known is not None and known.controlled:
        return effect, None, len(inputs) if effect.on_command else names_of(inputs).index(known.input)
    if not channel:
        return effect, None if effect.port == "input" else plants_of(data, data.channels)[0], 0
    names = names_of(inputs if effect.port == "input" else outputs)
    if channel not in names:
        raise UnusableInput(f"{name}:{channel}: there is no such {effect.port}; known are {', '.join(names)}")
    at = names.index(channel)
    if effect.port == "input":
        return effect, None, at
    plant = next(plant for plant in plants_of(data, data.channels) if at in plant)
    return effect, plant, plant.index(at) if effect.port == "output" else 0


def names_of(channels: Sequence[Channel]) -> list[str]:
    """List the names of channels."""
    return [channel.name for channel in channels]
