"""The cases of the benchmark: drawn from a secret seed, written as data sets without the truth."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path

import numpy as np

from simgap.data import save
from simgap.data.simulated import field, rigs
from simgap.diagnosis.cases import Case, room_of
from simgap.records import UnusableInput
from simgap.registry import EFFECTS

CARD = "cases.json"
# Of twenty cases; "outside" is an effect that no catalogue holds.
PATTERN = (
    "single", "clean", "pair", "single", "single", "single", "clean", "single", "outside", "single",
    "single", "clean", "single", "pair", "single", "single", "clean", "single", "pair", "single",
)  # fmt: skip
STRENGTHS = (0.4, 1.0)
NOISES = (0.01, 0.1)  # of the true motion
LARGEST_COLOUR = 0.9  # of every second case
MOST_CASES = 10_000


def make_cases(seed: str, count: int, folder: str | Path) -> dict[str, Case]:
    """Write `count` cases into a new folder and return what is hidden in each, which is written nowhere.

    Each is a data set folder with columns, units, kinds and sampling time. `cases.json` beside them holds the digest
    that answers must repeat and the effects that may be named. Raises UnusableInput.
    """
    folder = Path(folder)
    cases = draw(seed, count)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UnusableInput(f"{folder} is not empty; choose a new folder, nothing is overwritten")
    for name, case in cases.items():
        dataset = room_of(case.rig).hide(case.rig, case.hidden(), case.noise, case.colour, case.seed)
        save(replace(dataset, name=name), folder / name)  # the name that it had holds the rig and the seed
    card = {"schema": 1, "cases": digest(seed, cases), "names": list(cases), "effects": effects()}
    (folder / CARD).write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    return cases


def draw(seed: str, count: int) -> dict[str, Case]:
    """Draw the cases of a seed, in the order of their names, which are random. Raises UnusableInput.

    Every effect is hidden as often as any other, in a machine that it suits. A machine with nothing hidden in it is
    drawn in the same way, so that which machine it is says nothing of whether something is hidden.
    """
    if not seed.strip():
        raise UnusableInput("--seed: give a text that nobody can guess, such as 20 random letters")
    if not 1 <= count <= MOST_CASES:
        raise UnusableInput(f"--cases {count}: give a number from 1 to {MOST_CASES}")
    rng = np.random.default_rng(_number(seed))
    order: list[str] = []
    cases = {}
    for i in range(count):
        if not order:
            order = [str(name) for name in rng.permutation(effects())]
        case = _drawn(PATTERN[i % len(PATTERN)], order, rng)
        cases[f"{_number(f'{seed} {i}'):032x}"[:12]] = replace(case, seed=_number(f"{seed} data {i}"))
    return dict(sorted(cases.items()))


def digest(seed: str, cases: Mapping[str, Case]) -> str:
    """How many cases there are, and a digest of the seed and all that is hidden, which only the seed explains."""
    hidden = {name: asdict(case) for name, case in cases.items()}
    return f"{len(cases)}-{hashlib.sha256(json.dumps([seed, hidden], sort_keys=True).encode()).hexdigest()}"


@cache
def effects() -> tuple[str, ...]:
    """The effects that are hidden and may be named."""
    return tuple(name for name in EFFECTS if machines(name))


@cache
def machines(effect: str) -> tuple[str, ...]:
    """The machines that an effect can be hidden in."""
    return tuple(rig for room in (rigs, field) for rig in room.RIGS if effect in room.suitable(rig))


def _drawn(kind: str, order: list[str], rng: np.random.Generator) -> Case:
    """Draw a case; the effect of a single one is the next in `order`."""
    effect = order.pop() if kind == "single" else str(rng.choice(effects()))
    rig = str(rng.choice(machines(effect)))
    while kind == "outside" and not room_of(rig).suitable(rig, outside=True):
        rig = str(rng.choice(machines(str(rng.choice(effects())))))
    others = [name for name in room_of(rig).suitable(rig) if name != effect]
    hidden = {
        "single": effect,
        "pair": ",".join(sorted((effect, str(rng.choice(others))))),
        "clean": "",
        "outside": str(rng.choice(room_of(rig).suitable(rig, outside=True) or ("",))),
    }[kind]
    strength = float(rng.uniform(*STRENGTHS)) if hidden else 0.0
    noise = float(np.exp(rng.uniform(*np.log(NOISES))))
    colour = float(rng.integers(2) * rng.uniform(0, LARGEST_COLOUR))
    return Case(rig, hidden, strength, noise, colour, 0)


def _number(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode("utf-8", "replace")).digest()[:16])
