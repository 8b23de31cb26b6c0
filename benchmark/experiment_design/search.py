"""The signal that sets rivals apart the farthest within the limits: a grid of shapes, then those near the best."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from simgap.experiment_design.limits import Limits
from simgap.experiment_design.rivals import Question
from simgap.experiment_design.separation import chunks, refitted, separations, simulate_likely
from simgap.experiment_design.signals import Shape, grid, slowed
from simgap.greybox.evidence import CONFOUNDED

BEST = 6  # shapes from which others are varied
VARIANTS = 8  # of each
ROUNDS = 5
ROWS = 4  # of inputs that do not move, which the grid tries
DRAWS = 16  # of the numbers of each rival, that a record must stay within the travel with
REFITTED = 3  # of the best, whose separation is computed by a fit


@dataclass(frozen=True)
class Separated:
    """One pair of rivals and a record: D if the first is true and if the second is, and the chance that it decides.

    difference: the RMS of the difference of both simulations after the wrong one was fitted to it, for each output.
    """

    first: str
    second: str
    d: tuple[float, float]
    chance: float
    difference: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Design:
    """A record within the limits: its inputs, the shape of each input that moves, what it separates and where it goes.

    reach: the lowest and the highest of each output that any of the rivals expects.
    """

    u: Float[np.ndarray, "T nu"]
    shapes: tuple[Shape, ...]
    separated: tuple[Separated, ...]
    reach: Float[np.ndarray, "2 ny"]

    @property
    def chance(self) -> float:
        """The chance that it decides the pair that it decides least."""
        return min((one.chance for one in self.separated), default=0.0)

    @property
    def worth(self) -> float:
        """What it separates, over all pairs, as the search compares records."""
        return float(_worth(np.array([min(one.d) for one in self.separated])).sum())


@dataclass(frozen=True)
class Candidate:
    """A shape for each input that moves, and the row that the others keep."""

    shapes: tuple[Shape, ...]
    row: int


def decides(d: float, behind: float) -> float:
    """Compute the chance that the true model ends up clearly ahead: its score by 6 or more.

    The log-likelihoods differ by D / 2 more than now, with a standard deviation of sqrt(D).
    """
    return float(norm.sf((CONFOUNDED + behind - d / 2) / math.sqrt(d))) if d > 0 else 0.0


def best_record(questions: Sequence[Question], limits: Limits, seed: int, rounds: int = ROUNDS) -> Design | None:
    """Search for the record that tells all pairs of all plants apart; None where no signal stays within the travel."""
    rng = np.random.default_rng(seed)
    rows = np.unique(np.linspace(0, len(limits.held) - 1, ROWS).round().astype(int))
    candidates = [
        Candidate(tuple(_another(shape, i) for i in range(len(limits.moved))), int(row))
        for row in rows
        for shape in grid(limits.samples)
    ]
    ranked = _ranked(questions, limits, candidates)
    for _ in range(rounds if ranked else 0):
        near = [_varied(one, limits, rng) for _, one in ranked[:BEST] for _ in range(VARIANTS)]
        ranked = sorted([*ranked[:BEST], *_ranked(questions, limits, near)], key=lambda pair: -pair[0])
    designs = [_design(questions, limits, candidate) for _, candidate in ranked[:REFITTED]]
    return max(designs, key=lambda design: design.worth, default=None)


def _another(shape: Shape, i: int) -> Shape:
    return Shape(shape.kind, shape.size, shape.centre, shape.period, shape.seed + 1000 * i)


def _varied(one: Candidate, limits: Limits, rng: np.random.Generator) -> Candidate:
    row = int(rng.integers(len(limits.held))) if rng.random() < 0.2 else one.row
    return Candidate(tuple(shape.varied(limits.samples, rng) for shape in one.shapes), row)


def _inputs(limits: Limits, candidates: Sequence[Candidate]) -> Float[np.ndarray, "E T nu"]:
    u = np.repeat(limits.held[[one.row for one in candidates]][:, None], limits.samples, axis=1)
    for at, i in enumerate(limits.moved):
        drawn = [one.shapes[at].between(limits.low[i], limits.high[i], limits.samples) for one in candidates]
        u[:, :, i] = slowed(np.stack(drawn), limits.rate[i], limits.dt)
    return np.ascontiguousarray(u)


def _worth(d: Float[np.ndarray, " E"]) -> Float[np.ndarray, " E"]:
    """Let a pair that is decided count little more, so that the others are decided too."""
    return d / (d + 4 * CONFOUNDED)


def _ranked(
    questions: Sequence[Question], limits: Limits, candidates: Sequence[Candidate]
) -> list[tuple[float, Candidate]]:
    """Sort the candidates that stay within the travel, the one that separates the most first."""
    u = _inputs(limits, candidates)
    low, high = _reach(questions, u, limits)
    fits = np.all((low >= limits.travel_low) & (high <= limits.travel_high), axis=1)
    inside = [int(i) for i in np.flatnonzero(fits)]
    if not inside:
        return []
    asked = [question for question in questions if question.pairs]
    worth = np.zeros(len(inside))
    for question in asked:
        for pair in separations(question, u[inside]):  # [2, E]
            worth += _worth(np.min(pair, axis=0))
    order = np.argsort(-worth, kind="stable")
    return [(float(worth[i]), candidates[inside[i]]) for i in order]


def _reach(
    questions: Sequence[Question], u: np.ndarray, limits: Limits
) -> tuple[Float[np.ndarray, "E ny"], Float[np.ndarray, "E ny"]]:
    """Find the lowest and the highest that any rival expects of each output, as far as its numbers are known."""
    reached = np.full((2, len(u), len(limits.travel_low)), np.nan)
    for question in questions:
        reached[:, :, list(question.outputs)] = np.concatenate(
            [_reach_of(question, chunk) for chunk in chunks(u)], axis=1
        )
    return reached[0], reached[1]


def _reach_of(question: Question, u: np.ndarray) -> Float[np.ndarray, "2 E ny"]:
    runs = [np.nan_to_num(simulate_likely(rival, u, DRAWS), nan=np.inf) for rival in question.rivals]  # [S, E, T, ny]
    low, high = ([extreme(run, axis=(0, 2)) for run in runs] for extreme in (np.min, np.max))
    return np.stack((np.min(low, axis=0), np.max(high, axis=0)))


def _design(questions: Sequence[Question], limits: Limits, candidate: Candidate) -> Design:
    u = _inputs(limits, [candidate])
    separated = []
    for question in questions:
        for first, second in question.pairs:
            d, difference = refitted(question, first, second, u[0])
            other, _ = refitted(question, second, first, u[0])
            ahead = question.rivals[second].behind - question.rivals[first].behind
            rms = np.sqrt(np.mean(difference**2, axis=0))
            separated.append(
                Separated(
                    question.rivals[first].title, question.rivals[second].title, (d, other),
                    min(decides(d, -ahead), decides(other, ahead)), tuple(map(float, rms)),
                )
            )  # fmt: skip
    return Design(u[0], candidate.shapes, tuple(separated), np.concatenate(_reach(questions, u, limits)))
