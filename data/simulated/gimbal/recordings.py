"""Recordings of the gimbal by the protocol of the paper, made here because the authors' are not public."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from numpy.random import default_rng

from simgap.data.simulated.gimbal.inputs import INPUTS
from simgap.data.simulated.gimbal.motion import DT, simulate_gimbal
from simgap.data.simulated.gimbal.parameters import Gimbal
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet, UnusableInput
from simgap.registry import DATASETS

__all__ = ["Gimbal", "gimbal", "gimbal_dataset", "simulate_gimbal"]

CHANNELS = Channels(
    inputs=(Channel("voltage", "V"),),
    outputs=(Channel("phi", "deg", "position"), Channel("phi_dot", "deg/s", "velocity")),
)

DEFAULT = Gimbal()
N_TRAIN = 151  # experiments, as many as the paper has
MOST_TRAIN = 5000

# The first session is the longest and mostly random; the authors then held two more, with the joystick above
# all, because the data lacked smooth motion (paper, 2.6). Kinds of input follow each other in this order.
SESSIONS = (
    ("gaussian", "binary", "uniform", "joystick", "gaussian", "binary", "uniform"),
    ("joystick", "gaussian", "joystick", "binary"),
    ("joystick", "uniform", "joystick", "gaussian", "joystick", "binary"),
)
SESSION_STARTS = (0.0, 0.5, 0.75)  # share of the experiments of a split that were made before


class Planned(NamedTuple):
    """One experiment to be made. `split` is 0 for training, 1 for validation, 2 for test."""

    split: int
    number: int
    session: int
    kind: str


@DATASETS.register("gimbal")
def gimbal(
    data: float = 1.0,
    noise: float = 1.0,
    friction: float = 1.0,
    drift: float = 1.0,
    stiffness: float = 1.0,
    delay: float = 0.0,
    n_init: int = 40,
) -> Dataset:
    """Yaw motion of a gimbal under a brushless motor: simulated recordings by the protocol of the paper.

    The authors' recordings are not public, as far as we could find, so none of these numbers was measured on
    a robot. 181 experiments in three sessions: 151 of 20 s to train, 15 of 40 s to validate, 15 of 40 s to
    test. Input `voltage` in V: Gaussian white, random binary, uniform or joystick-like, at 10 Hz within 8 V.
    Outputs `phi` in deg and `phi_dot` in deg/s, sampled at 200 Hz, every 20th sample kept (dt 0.1 s). Coulomb
    friction with sticking, cable torque over position, encoder counts, gyro noise, and a drift of both
    readings that differs from experiment to experiment. n_init is 40 samples, the window of the paper's
    networks, so that every model may fill one such window before it is on its own.

    Parameters may stand behind the name, "gimbal-data0.25-noise4": how many times the usual training experiments,
    noise of both readings, Coulomb friction, drift of both readings and stiffness of the cable it has; the delay of
    the input in s; n_init. What is not changed stays the same experiment. Raises UnusableInput.

    Reference: "Recurrent and Convolutional approaches for System Identification", section 2.
    """
    return _under(DEFAULT, "gimbal", data, noise, friction, drift, stiffness, delay, n_init)


@DATASETS.register("gm6020")
def gm6020(
    data: float = 1.0,
    noise: float = 1.0,
    friction: float = 1.0,
    drift: float = 1.0,
    stiffness: float = 1.0,
    delay: float = 0.0,
    n_init: int = 40,
) -> Dataset:
    """Yaw motion of a robot on a GM6020 motor: simulated with inertia, damping and friction that others measured.

    Inputs, sensors, experiments and parameters behind the name as for `gimbal`; the axis has no gear, half the damping
    and turns three times as far (`Gimbal.of_gm6020`). Raises UnusableInput.
    """
    return _under(Gimbal.of_gm6020(), "gm6020", data, noise, friction, drift, stiffness, delay, n_init)


def _under(
    usual: Gimbal, name: str, data: float, noise: float, friction: float, drift: float, stiffness: float,
    delay: float, n_init: int,
) -> Dataset:  # fmt: skip
    """Record a gimbal under conditions that are given as multiples of the usual ones, delay [s] and n_init as such."""
    n_train = round(N_TRAIN * data)
    if not 1 <= n_train <= MOST_TRAIN:
        made = f"data={data:g} makes {n_train} training experiments"
        raise UnusableInput(f"{name}: {made}; 1 to {MOST_TRAIN} can be made")
    parameters = replace(
        usual,
        noise=(noise * usual.noise[0], noise * usual.noise[1]),
        drift=(drift * usual.drift[0], drift * usual.drift[1]),
        coulomb=friction * usual.coulomb,
        cable_stiffness=stiffness * usual.cable_stiffness,
        input_delay=delay,
    )
    return gimbal_dataset(parameters, n_train=n_train, n_init=n_init, name=name)


@DATASETS.register("gimbal_short")
def gimbal_short() -> Dataset:
    """Twelve short recordings of the simulated gimbal, for a quick look and for tests.

    The first 8 experiments to train, 2 to validate and 2 to test of the same plan, of 20 s each; else as `gimbal`.
    """
    return gimbal_dataset(n_train=8, n_valid=2, n_test=2, seconds=(20.0, 20.0, 20.0), name="gimbal_short")


def gimbal_dataset(
    parameters: Gimbal = DEFAULT,
    seed: int = 0,
    n_train: int = N_TRAIN,
    n_valid: int = 15,
    n_test: int = 15,
    seconds: tuple[float, float, float] = (20.0, 40.0, 40.0),
    n_init: int = 40,
    name: str = "gimbal",
) -> Dataset:
    """Record a gimbal with the given parameters; `seconds` are the lengths in train, valid and test.

    Inputs and noise follow from `seed` alone: parameters that differ give the same experiments, otherwise
    measured. Names such as `s1_003_binary` carry session, running number and kind of input.
    """
    counts = (n_train, n_valid, n_test)
    splits: tuple[list[Experiment], ...] = ([], [], [])
    for number, planned in enumerate(_plan(counts), start=1):
        experiment_name = f"s{planned.session + 1}_{number:03d}_{planned.kind}"
        samples = round(seconds[planned.split] / DT)
        splits[planned.split].append(_record(parameters, seed, planned, samples, experiment_name))
    train, valid, test = map(tuple, splits)
    return Dataset(name, TrainingSet(train, valid, n_init, CHANNELS), test, n_init, CHANNELS)


def _plan(counts: Sequence[int]) -> list[Planned]:
    """List all experiments in the order in which they are made, session after session."""
    plan = []
    for split, count in enumerate(counts):
        made = [0, 0, 0]
        for index in range(count):
            session = sum(index >= start * count for start in SESSION_STARTS) - 1
            kinds = SESSIONS[session]
            plan.append(Planned(split, index, session, kinds[made[session] % len(kinds)]))
            made[session] += 1
    return sorted(plan, key=lambda planned: planned.session)


def _record(parameters: Gimbal, seed: int, planned: Planned, samples: int, name: str) -> Experiment:
    # The seed of an experiment is its place in its split, so that no split depends on the size of another.
    input_rng, plant_rng = default_rng([seed, planned.split, planned.number]).spawn(2)
    u = INPUTS[planned.kind](samples, input_rng)[:, None]  # [T, 1]
    friction = parameters.session_friction[planned.session]
    today = replace(parameters, coulomb=parameters.coulomb * friction, viscous=parameters.viscous * friction)
    return Experiment(name, u, simulate_gimbal(today, u, plant_rng), DT)
