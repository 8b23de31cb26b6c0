"""A motion imposed on a machine, and the force that it takes: no dynamics, and friction in the plant itself."""

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.diagnosis.diagnose import diagnose
from simgap.greybox.linear import find_baseline
from simgap.records import Channel, Channels, Dataset, TrainingSet

from .building import share_left_over
from .parts import experiments

DT = 0.01


def strokes(rng, count=8, samples=1200):
    """Slow motions [E, T] in mm that swing over changing strokes, each from another place."""
    t = DT * np.arange(samples)
    parts = [np.sin(2 * np.pi * rate * t + phase) for rate, phase in zip((0.7, 1.1), (0.3, 1.7), strict=True)]
    mixed = rng.uniform(4, 12, (count, 2)) @ np.stack(parts)
    return mixed + rng.uniform(-3, 3, (count, 1))


def slipping(x, stiffness, gap, most, begin):
    """Force of a spring with a gap that slips at `most`, over x [T]: by a bristle that is dragged along."""
    reach = gap / 2 + most / stiffness  # that the bristle is bent at most
    bent, forces = begin * reach, np.empty_like(x)
    for k, step in enumerate(np.diff(x, prepend=x[0])):
        bent = np.clip(bent + step, -reach, reach)
        forces[k] = stiffness * np.sign(bent) * max(abs(bent) - gap / 2, 0.0)
    return forces


def play(x, gap, begin):
    """What arrives of x [T] behind a gap, from anywhere in it."""
    at, arrived = x[0] + 0.5 * gap * begin, np.empty_like(x)
    for k, here in enumerate(x):
        at = min(max(at, here - gap / 2), here + gap / 2)
        arrived[k] = at
    return arrived


def dataset(respond, seed, noise=0.05):
    """Force over imposed position, each record begun in the middle of a motion."""
    rng = np.random.default_rng(seed)
    x = strokes(rng)
    force = np.stack([respond(of_one, begin) for of_one, begin in zip(x, rng.uniform(-1, 1, len(x)), strict=True)])
    force = force + noise * force.std() * rng.standard_normal(force.shape)
    made = experiments(x, force[:, :, None], DT)
    channels = Channels((Channel("x", "mm"),), (Channel("force", "kN", "other"),))
    return Dataset(
        "damper", TrainingSet(tuple(made[:4]), tuple(made[4:5]), 10, channels), tuple(made[5:]), 10, channels
    )


def first_name(answer):
    """The verdict with its first cause."""
    return answer.findings.verdict, *[cause.effect for cause in answer.causes[:1]]


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0.0, 6.0])
def test_a_spring_that_slips_is_hysteresis_with_the_gap_that_it_crosses(gap):
    answer = diagnose(dataset(lambda x, begin: slipping(x, 2.0, gap, 5.0, begin) + 0.1 * x, seed=1), views_too=False)
    assert first_name(answer) == ("named", "hysteresis")
    values = {value.name: value.value for value in answer.causes[0].parameters}
    # The law rounds the corner at which the spring slips, so that no number has an exact counterpart.
    assert values["force"] == pytest.approx(5.0, rel=0.2) and values["gap"] == pytest.approx(gap, abs=0.8)


@pytest.mark.slow
def test_a_valve_with_play_is_backlash_wherever_in_its_gap_a_record_begins():
    answer = diagnose(dataset(lambda x, begin: 3.0 * play(x, 4.0, begin), seed=2), views_too=False)
    assert first_name(answer) == ("named", "backlash")
    assert answer.causes[0].parameters[0].value == pytest.approx(4.0, rel=0.2)


def test_dry_friction_is_named_where_there_is_nothing_but_friction():
    def respond(x, begin):
        return 0.3 * x + 2.0 * np.sign(np.diff(x, prepend=x[0]))

    assert first_name(diagnose(dataset(respond, seed=3), views_too=False)) == ("named", "coulomb_friction")


@pytest.mark.parametrize("seed", range(3))
def test_a_spring_with_a_damper_has_nothing_to_name(seed):
    def respond(x, begin):
        return 0.3 * x + 0.05 * np.gradient(x, DT)

    assert first_name(diagnose(dataset(respond, seed), views_too=False)) == ("nothing_found",)


def of_velocity(respond, seed):
    """What a velocity [E, T] in mm/s brings about, with noise of 2 %."""
    rng = np.random.default_rng(seed)
    v = np.gradient(strokes(rng, 6, 400), DT, axis=1)
    y = respond(v)
    made = experiments(v, (y + 0.02 * y.std() * rng.standard_normal(y.shape))[:, :, None], DT)
    channels = Channels((Channel("v", "mm/s", "velocity"),), (Channel("y", "", "other"),))
    return Dataset(
        "by rate", TrainingSet(tuple(made[:3]), tuple(made[3:4]), 10, channels), tuple(made[4:]), 10, channels
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("respond", "name", "number"),
    [
        (lambda v: 0.1 * v + 3.0 * np.sign(v), "coulomb_friction", 3.0),
        (lambda v: 0.1 * v + 0.002 * v * np.abs(v), "quadratic_drag", 0.002),
    ],
)
def test_of_a_machine_whose_velocity_is_imposed_the_force_is_named_with_its_size(respond, name, number):
    answer = diagnose(of_velocity(respond, seed=1), views_too=False)
    assert first_name(answer) == ("named", name)
    assert answer.causes[0].parameters[0].value == pytest.approx(number, rel=0.05)


@pytest.mark.slow
def test_of_a_machine_whose_velocity_is_imposed_a_spring_that_slips_is_hysteresis():
    def respond(v):
        motions = DT * np.cumsum(v, axis=1)
        return 0.02 * v + np.stack([slipping(x, 4.0, 0.0, 5.0, 0.0) for x in motions])

    answer = diagnose(of_velocity(respond, seed=2), views_too=False)
    assert first_name(answer) == ("named", "hysteresis")


def test_what_a_velocity_only_drives_keeps_its_poles():
    """The air along a hot wire is no motion that takes a force."""
    decay = np.exp(-DT / 0.3)
    answer = diagnose(of_velocity(lambda v: lfilter([0.0, 1 - decay], [1.0, -decay], 0.1 * v), seed=3), views_too=False)
    assert not answer.causes
    assert answer.to_json()["baseline"]["order"] > 0


def test_what_a_missing_force_leaves_of_an_imposed_motion_is_seen_undifferentiated():
    training = dataset(lambda x, begin: 2.0 * x + 30.0 * np.sign(np.gradient(x)), seed=3).training
    plain = find_baseline(training.train, training.valid, training.channels, (0,), 10)
    assert plain.plant.imposed
    assert share_left_over(plain) > 0.5
