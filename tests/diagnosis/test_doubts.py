"""Records on which nothing can be named: they show the controller, or no model beats their mean."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.diagnosis.diagnose import diagnose
from simgap.diagnosis.doubts import of_records, shows_controller
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet

CHANNELS = Channels((Channel("op", "%"),), (Channel("pv", "m", "level"),))


def loop(seed, closed, samples=800):
    """A level under a disturbance, with a controller that sets the valve in the same sample, or with random steps."""
    rng = np.random.default_rng(seed)
    level, valve, pv, op = 0.0, 0.0, np.empty(samples), np.empty(samples)
    disturbance = np.cumsum(0.2 * rng.standard_normal(samples))
    for k in range(samples):
        pv[k] = level
        valve = -4.0 * level if closed else (rng.uniform(-1, 1) if k % 20 == 0 else valve)
        op[k] = valve
        level += 0.05 * (valve + disturbance[k] * closed - 0.3 * level)
    return Experiment(f"e{seed}", op[:, None], pv[:, None], 1.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_controller_is_seen_by_the_sample_that_it_answers_in(seed):
    assert "shows the controller" in (shows_controller([loop(seed, closed=True)], CHANNELS) or "")
    assert shows_controller([loop(seed, closed=False)], CHANNELS) is None


def test_a_spring_that_answers_an_imposed_motion_at_once_is_no_controller():
    x = np.sin(np.arange(400) / 7)[:, None]
    run = Experiment("rig", x, 100 * x + 4 * x**3, 0.01)
    motion, force = Channel("x", "mm", "position"), Channel("F", "N", "other")
    assert shows_controller([run], Channels((motion,), (force,))) is None
    said = shows_controller([run], Channels((Channel("x"),), (Channel("F"),)))
    assert said is not None and "If x is an imposed motion" in said


def test_nothing_is_named_on_a_record_of_the_controller_and_the_first_sentence_says_so():
    made = [loop(seed, closed=True) for seed in range(5)]
    training = TrainingSet(tuple(made[:3]), (made[3],), 10, CHANNELS)
    answer = diagnose(Dataset("loop", training, (made[4],), 10, CHANNELS), views_too=False)
    assert answer.findings.verdict == "nothing_found" and not answer.causes and not answer.findings.suspects
    assert "shows the controller" in answer.findings.doubts[0]
    assert str(answer).startswith("loop: Nothing is named. op answers pv")


def unrelated(rng, name, levels):
    """An output that has nothing to do with the input, around one level for 300 samples and then around the next."""
    u = np.repeat(rng.uniform(-1, 1, 30 * len(levels)), 10)[:, None]
    return Experiment(name, u, np.repeat(levels, 300)[:, None] + rng.standard_normal((len(u), 1)), 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("levels", "said"),
    [
        ([[0], [10], [20], [30], [40]], "another operating point in each record"),
        ([[0, 30, -10, 40, -20], [20, -20], [-40, 30]], "the inputs do not move y enough"),
    ],
)
def test_nothing_is_named_where_the_mean_is_the_better_model(levels, said):
    rng = np.random.default_rng(0)
    *train, valid, test = [unrelated(rng, f"e{i}", np.array(one, dtype=float)) for i, one in enumerate(levels)]
    channels = Channels((Channel("u", "V"),), (Channel("y", "m/s", "velocity"),))
    training = TrainingSet(tuple(train), (valid,), 10, channels)
    answer = diagnose(Dataset("unrelated", training, (test,), 10, channels), views_too=False)
    assert not answer.causes
    assert any("better than its mean" in sentence and said in sentence for sentence in answer.findings.doubts)


@pytest.mark.slow
def test_where_a_held_out_record_stands_still_it_is_said_to_tell_nothing():
    rng = np.random.default_rng(0)

    def run(name, moves):
        u = np.repeat(rng.uniform(-1, 1, 60), 10)[:, None]
        return Experiment(
            name, u, lfilter([0, 0.1], [1, -0.9], moves * u, axis=0) + 0.01 * rng.standard_normal(u.shape), 1.0
        )

    *train, valid, test = [run(f"e{i}", moves) for i, moves in enumerate((1, 1, 1, 0, 1))]
    channels = Channels((Channel("u", "V"),), (Channel("y", "m/s", "velocity"),))
    training = TrainingSet(tuple(train), (valid,), 10, channels)
    answer = diagnose(Dataset("stuck", training, (test,), 10, channels), views_too=False)
    assert not answer.causes
    assert any("y stands still in the held-out record" in sentence for sentence in answer.findings.doubts)


@pytest.mark.parametrize("level", [0.0, 3.0])
def test_an_output_that_never_moves_is_said_to_stand_still(level):
    rng = np.random.default_rng(0)
    *train, valid, test = [unrelated(rng, f"e{i}", np.zeros(1)) for i in range(5)]
    still = [replace(x, y=np.full_like(x.y, level)) for x in (*train, valid, test)]
    channels = Channels((Channel("u", "V"),), (Channel("y", "m", "position"),))
    training = TrainingSet(tuple(still[:3]), (still[3],), 10, channels)
    answer = diagnose(Dataset("still", training, (still[4],), 10, channels), views_too=False)
    assert not answer.causes
    assert any("y never moves. Check the sensor" in sentence for sentence in answer.findings.doubts)


@pytest.mark.parametrize(("samples", "short"), [(19, True), (20, False)])
def test_of_fewer_samples_than_a_model_is_judged_by_the_first_sentence_says_so(samples, short):
    u = np.random.default_rng(0).normal(size=(samples, 1))
    training = TrainingSet(
        (Experiment("e", u, np.random.default_rng(1).normal(size=(samples, 1)), 1.0),), (), 2, CHANNELS
    )
    said = of_records(training, CHANNELS) or ""
    assert ("only 19 training samples, which tell no cause; record 200 or more" in said) == short
