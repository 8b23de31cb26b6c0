"""Pieces of a run: what came before a cut acts after it, as it does in the whole run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parameters_of_effects import scales, signal, values_of

from simgap.diagnosis.diagnose import diagnose
from simgap.greybox.drive import Drive
from simgap.greybox.effects.effect import InputEffect
from simgap.greybox.past import Past
from simgap.greybox.plant import Plant
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import PlantScales, Term
from simgap.records import LONGEST_PAST, Channel, Channels, Dataset, Experiment, TrainingSet
from simgap.registry import EFFECTS

DT = 0.1
KINDS = ("velocity", "other", "level")


def kind_for(law):
    """What the law suits; nothing where it is one of a controller inside a machine."""
    return next((kind for kind in KINDS if law().suits(scales(kind, 1))), None)


LAWS = [
    law
    for name in sorted(EFFECTS)
    for law in EFFECTS[name].laws().values()
    if issubclass(law, InputEffect) and kind_for(law)
]


def run_of(length=120, nu=1, since=0.0):
    """One run of several inputs, and of outputs that nobody looks at."""
    u = np.stack([signal(seed, length) for seed in range(nu)], axis=1)
    return Experiment("run", u, np.arange(float(length))[:, None], DT, since)


def plant_with(law):
    """A plant of first order behind it."""
    seen = scales(kind_for(law), 1)
    plant = Plant(seen.kind, 1, 1, DT, scales=PlantScales((seen,), (seen,)))
    return plant.having([Term(law())]), seen


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_an_input_arrives_after_a_cut_as_it_does_in_the_whole_run(law):
    plant, seen = plant_with(law)
    run = run_of()
    piece = run[63:]
    for values in values_of(law(), seen):
        theta = np.concatenate(([1.5, 2.0], values))
        start = np.full((1, plant.n_moving - plant.order), 0.4)
        whole = Drive(plant, run.u[None]).arriving(theta, 0, start)[:, 63 * plant.substeps :]
        cut = Drive(plant, piece.u[None], Past.of([piece])).arriving(theta, 0, start)
        if plant.remembered:  # it is told where it begins
            anew = Drive(plant, piece.u[None]).arriving(theta, 0, start)
            np.testing.assert_array_equal(cut, anew)
        else:
            np.testing.assert_allclose(cut, whole, atol=1e-9)


@pytest.mark.parametrize("name", ["input_delay", "actuator_lag", "rate_limit"])
def test_without_what_came_before_it_arrives_otherwise(name):
    plant, seen = plant_with(EFFECTS[name])
    run = run_of()
    differences = []
    for values in values_of(EFFECTS[name](), seen):
        theta = np.concatenate(([1.5, 2.0], values))
        of_whole, of_piece = (Drive(plant, x.u[None]).arriving(theta, 0) for x in (run, run[63:]))
        differences.append(np.abs(of_piece - of_whole[:, 63 * plant.substeps :]).max())
    assert max(differences) > 0.1


def test_the_sample_before_a_cut_acts_through_its_gain():
    plant = Plant("other", 1, 2, DT, taps=(0, -1, 1))
    theta = np.random.default_rng(0).standard_normal(plant.size)
    run = run_of(nu=2)
    piece = run[63:]
    whole, cut = Drive(plant, run.u[None]), Drive(plant, piece.u[None], Past.of([piece]))
    np.testing.assert_allclose(cut.of(theta), whole.of(theta)[:, 63 * plant.substeps :])
    np.testing.assert_allclose(cut.of_each(theta[None], np.zeros((1, 1, 0)))[0], cut.of(theta))


def test_an_imposed_velocity_moves_from_zero_at_the_cut_whatever_came_before():
    seen = scales("other", 0)
    plant = Plant("other", 0, 1, DT, by_rate=True, scales=PlantScales((seen,), (seen,)))
    run, theta = run_of(), np.zeros(plant.size)
    piece, none = run[63:], np.zeros((1, 0))
    whole, _ = Simulator(plant, run.u[None]).drive.motion(theta, none)
    cut, rate = Simulator(plant, piece.u[None], Past.of([piece])).drive.motion(theta, none)
    later = whole[:, 63 * plant.substeps :]
    np.testing.assert_allclose(cut, later - later[:, :1], atol=1e-9)
    np.testing.assert_array_equal(rate[:, :: plant.substeps], piece.u.T)


@settings(deadline=None)
@given(a=st.integers(0, 700), b=st.integers(0, 300), since=st.floats(0, 1e3))
def test_a_piece_of_a_piece_is_a_piece_of_the_run(a, b, since):
    run = run_of(1200, 2, since)
    twice, once = run[a:][b : b + 50], run[a + b : a + b + 50]
    np.testing.assert_array_equal(twice.before, once.before)
    np.testing.assert_array_equal(twice.before, run.u[max(0, a + b - LONGEST_PAST) : a + b])
    assert twice.since == pytest.approx(once.since)
    np.testing.assert_array_equal(twice.u, once.u)


@settings(deadline=None)
@given(first=st.integers(0, 80), samples=st.integers(7, 30))
def test_records_are_cut_as_their_experiments_are(first, samples):
    runs = [run_of(160)[first : first + 80], run_of(80)]
    starts = range(0, 80 - samples + 1, samples)
    cut = Records.of(runs, (0,)).pieces(samples).past
    experiments = Past.of([run[a : a + samples] for run in runs for a in starts])
    np.testing.assert_array_equal(cut.u, experiments.u)
    np.testing.assert_allclose(cut.since, experiments.since)


def test_the_second_half_of_a_record_knows_the_first():
    run = run_of(80)
    earlier, later = Records.of([run], (0,)).halves()
    assert earlier.past.u.shape == (1, 0, 1)
    np.testing.assert_array_equal(later.past.u, run.u[None, :40])
    assert later.past.since == pytest.approx([40 * DT])


def test_a_record_without_one_whole_piece_has_none():
    assert Records.of([run_of(20)], (0,)).pieces(30).past.u.shape == (0, 0, 1)


def heater(rng):
    """A heater with a dead time of 12 samples; of 2000 samples, a step is 8 samples before the last fifth."""
    u = np.repeat(rng.choice([0.0, 20.0, 40.0, 60.0, 80.0, 100.0], 25), 66)[:1608]
    u = np.concatenate((u[:1592], np.repeat([0.0, 100.0, 20.0, 80.0, 40.0, 60.0], 68)))[:2000]
    late = np.concatenate((np.repeat(u[:1], 12), u[:-12]))
    y, x = np.empty(2000), 0.72 * u[0]
    for k in range(2000):
        y[k] = x
        x += -np.expm1(-5 / 300) * (0.72 * late[k] - x)
    return Experiment("log", u[:, None], (y + 0.05 * rng.standard_normal(2000))[:, None], 5.0)


@pytest.mark.slow
def test_a_dead_time_is_named_where_the_log_is_cut_behind_a_step():
    log = heater(np.random.default_rng(5))
    channels = Channels((Channel("power", "%"),), (Channel("temperature", "degC", "other"),))
    training = TrainingSet((log[:1200],), (log[1200:1600],), 5, channels)
    found = diagnose(Dataset("heater", training, (log[1600:],), 5, channels))
    (cause,) = found.findings.causes
    assert cause.effect == "input_delay"
    assert cause.parameters[0].value == pytest.approx(60.0, rel=0.02)
    assert found.findings.gain.after["temperature"] < 0.06  # of noise 0.05; 0.15 without what came before
