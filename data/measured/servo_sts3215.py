"""The servo of K-Scale Labs' public identification runs, read from the user's own clone of their repository."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from simgap.data.formats.plant_table import with_known
from simgap.data.measured.locations import reads
from simgap.data.splits import assemble
from simgap.records import Channel, Channels, Dataset, Experiment, UnusableInput
from simgap.registry import DATASETS

SITE = "https://github.com/kscalelabs/sysid"
RAW = "data/feetech/STS_3215_12V_20250317/raw"
ENTRIES = ("position", "goal_position", "torque_enable", "input_volts", "timestamp")
NUMBERS = ("kp", "mass", "length", "sample_rate")
LATE = 0.5  # samples by which a reading may come early or late; a clock that jitters more would shift the record
HELD_OUT = {"kp": 12.0, "mass": 0.969}  # runs with either test
TO_VALIDATE = {"kp": 16.0, "length": 0.15}  # runs with both validate
ALIKE = 0.002  # kg; the masses are written in full
PLANT = {
    "mass": "mass_kg", "arm": "arm_m", "supply": "volts", "enabled": "enabled", "gravity": True,
    "controller": {"goal": "goal_rad", "gain": "kp"},
}  # fmt: skip
CHANNELS = Channels(
    (
        Channel("goal_rad", "rad"), Channel("enabled"), Channel("volts", "V"), Channel("kp"), Channel("mass_kg", "kg"),
        Channel("arm_m", "m"),
    ),
    (Channel("q_rad", "rad", "position"),),
)  # fmt: skip


@DATASETS.register("sts3215")
@reads("sysid", f"{RAW}/*.json", download=None, where=SITE)
def sts3215(folder: Path) -> Dataset:
    """STS3215: a hobby servo with its position controller inside, moving a pendulum.

    Machine: Feetech STS3215, 12 V, with 0.535 to 1.168 kg on an arm of 100 or 150 mm, controller gains 4 to 32. Five
        movements; in lift_and_drop the motor is switched off.
    Channels: goal [rad], motor enabled, supply [V], gain, mass [kg], arm [m] -> angle [rad]; a table [plant] says so.
    Samples: 240 runs of 600 at 100 Hz, the first of four repetitions. Gain 12 and mass 0.969 kg are held out to test,
        gain 16 on the long arm validates. Single readings of -3.14 rad are glitches, and stay.
    Source: K-Scale Labs, github.com/kscalelabs/sysid, STS_3215_12V_20250317/raw, 17 March 2025.
    Licence: none stated; read from a clone of your own, which SIMGAP_DATA names. Nothing of it comes with simgap.
    """
    return runs_of(folder / RAW, "sts3215", repetition=0)


def runs_of(raw: Path, name: str, repetition: int | None = None) -> Dataset:
    """Read a folder of such JSON files; of each condition one repetition, counted from 0 in order of time, or all.

    Raises UnusableInput for a file that is no run, and where no run is left for a split.
    """
    counts: dict[tuple[Any, ...], int] = {}
    splits: dict[str, list[Experiment]] = {"train": [], "valid": [], "test": []}
    for trajectory, numbers, run in _runs(raw):
        condition = (trajectory, *numbers.values())
        count = counts[condition] = counts.get(condition, -1) + 1
        if repetition is not None and count != repetition:
            continue
        kp, mass, arm = (numbers[key] for key in NUMBERS[:3])
        called = f"{trajectory}_kp{kp:g}_m{mass:.2f}_l{arm:g}" + ("" if repetition is not None else f"_{count}")
        u = np.column_stack((run["goal_position"], run["torque_enable"], run["input_volts"],
                             np.tile([kp, mass, arm], (len(run["position"]), 1))))  # fmt: skip
        splits[_split(numbers)].append(Experiment(called, u, run["position"][:, None], 1 / numbers["sample_rate"]))
    for split, found in splits.items():
        if not found:
            raise UnusableInput(f"{raw} holds no run for the {split} split; it needs runs of several gains and masses")
    parts = (tuple(splits["train"]), tuple(splits["valid"]), tuple(splits["test"]))
    return with_known(assemble(name, parts, CHANNELS, 20, str(raw)), PLANT)


def _split(numbers: dict[str, float]) -> str:
    if any(abs(numbers[key] - value) < ALIKE for key, value in HELD_OUT.items()):
        return "test"
    return "valid" if all(abs(numbers[key] - value) < ALIKE for key, value in TO_VALIDATE.items()) else "train"


def _runs(raw: Path) -> Iterator[tuple[str, dict[str, float], dict[str, np.ndarray]]]:
    """Yield movement, constants and columns of each run, in order of the time in the files' names."""
    for file in sorted(raw.glob("*.json"), key=lambda file: file.stem.rsplit("_", 2)[-2:]):
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            numbers = {key: float(content[key]) for key in NUMBERS}
            rows = content["entries"]
            run = {key: np.array([float(row[key]) for row in rows]) for key in ENTRIES}
            trajectory = str(content["trajectory"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            why = f"{type(error).__name__} {' '.join(str(error).split())}"[:200]
            raise UnusableInput(f"{file} is no run of that servo ({why}); restore it from {SITE}") from error
        t = (run["timestamp"] - run["timestamp"][0]) * numbers["sample_rate"] if len(rows) else np.zeros(0)
        late = np.flatnonzero(~(np.abs(t - np.arange(len(t))) < LATE))
        if late.size or not len(t):
            where = f"reading {late[0]} comes {t[late[0]] - late[0]:.2g} samples late" if late.size else "it is empty"
            raise UnusableInput(f"{file}: {where}; leave the file out")
        yield trajectory, numbers, run
