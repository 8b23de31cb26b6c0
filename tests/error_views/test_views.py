import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from simgap.error_views.views import views
from simgap.error_views.wrong import Wrong
from simgap.records import Channel, Channels, Experiment

N_INIT, DT, HOLD = 5, 0.1, 15

Runs = tuple[list[Experiment], list[np.ndarray], Channels]
Error = Callable[[int, np.ndarray, np.ndarray, np.random.Generator], np.ndarray]


def simulate(u: np.ndarray, kind: str) -> np.ndarray:
    """A motor: u in V, velocity in deg/s with a time constant of a second, or position in deg."""
    v = lfilter([0.1], [1, -0.9], u)
    return np.cumsum(v) * DT if kind == "position" else v


def runs(error: Error, kind: str = "velocity", n: int = 8, samples: int = 200, seed: int = 0) -> Runs:
    """Experiments whose measurement is the simulation plus error(i, u, v, rng)."""
    rng = np.random.default_rng(seed)
    experiments, simulated = [], []
    for i in range(n):
        u = np.repeat(rng.normal(size=samples // HOLD + 1), HOLD)[:samples]
        y_hat = simulate(u, kind)
        y = y_hat + error(i, u, simulate(u, "velocity"), rng)
        experiments.append(Experiment(f"s1_{i:03d}_{('binary', 'steps')[i % 2]}", u[:, None], y[:, None], DT))
        simulated.append(y_hat[N_INIT:, None])
    unit = {"position": "deg", "velocity": "deg/s"}.get(kind, "m")
    return experiments, simulated, Channels((Channel("u", "V"),), (Channel("phi", unit, kind),))


def found(*given) -> dict[str, Wrong]:
    return {view.label: view for view in views(*runs(*given), N_INIT)}


def real(views_found: dict[str, Wrong]) -> list[str]:
    return [name for name, view in views_found.items() if view.chance < 0.01]


def noise(rng: np.random.Generator, like: np.ndarray, size: float = 0.2) -> np.ndarray:
    return size * rng.normal(size=len(like))


@pytest.mark.parametrize("kind", ["velocity", "position"])
def test_an_error_like_coulomb_friction_is_seen_first_by_the_sign_of_the_velocity(kind):
    seen = found(lambda i, u, v, rng: 0.4 * np.sign(v) + noise(rng, v), kind)
    first = next(iter(seen.values()))
    assert first.view == "sign of velocity"
    assert first.share > 0.5
    assert first.chance < 0.01
    assert seen["time since reversal"].chance > 0.01
    np.testing.assert_allclose(first.error[::2] if len(first.at) > 2 else first.error, (-0.4, 0.4), atol=0.05)
    unit = "deg" if kind == "position" else "deg/s"
    assert f" {unit} too low when turning forwards and " in first.text
    assert f" {unit} too high when turning back: " in first.text


def test_one_experiment_is_enough_for_an_error_like_coulomb_friction():
    assert "sign of velocity" in real(found(lambda i, u, v, rng: 0.4 * np.sign(v) + noise(rng, v), "velocity", 1, 200))


def test_an_error_that_follows_reversals_is_seen_by_the_time_since_them():
    def backlash(i, u, v, rng):
        turned = np.concatenate([[False], np.diff(np.sign(v)) != 0])
        sample = np.arange(len(v))
        since = sample - np.maximum.accumulate(np.where(turned, sample, -100))
        return np.where(since < 8, -np.sign(v), 0) + noise(rng, v)

    view = found(backlash)["time since reversal"]
    assert view.chance < 0.01
    assert view.share > 0.2
    assert "after it began turning" in view.text


def test_an_error_at_high_input_is_seen_first_by_the_input():
    seen = found(lambda i, u, v, rng: 2 * np.maximum(0, u - 0.8) + noise(rng, v))
    first = next(iter(seen.values()))
    assert (first.view, first.channel) == ("input", "u")
    assert first.chance < 0.01
    assert first.unit == "V"
    assert "too low where the input u is above" in first.text


def test_a_drift_that_experiments_share_is_seen_by_time():
    seen = found(lambda i, u, v, rng: 0.005 * (np.arange(len(v)) - 100) + noise(rng, v))
    assert {"time since the start", "drift within experiment"} <= set(real(seen))
    assert max(seen.values(), key=lambda view: view.share).view in ("time since the start", "drift within experiment")
    assert seen["time since the start"].unit == "s"


def test_a_drift_of_its_own_in_each_experiment_is_seen_within_experiments():
    seen = found(lambda i, u, v, rng: (-1) ** i * 0.005 * (np.arange(len(v)) - 100) + noise(rng, v))
    assert seen["drift within experiment"].chance < 0.01
    assert seen["drift within experiment"].share > 0.5
    assert seen["time since the start"].chance > 0.01


def test_an_error_in_one_experiment_is_seen_first_by_experiment():
    seen = found(lambda i, u, v, rng: (i == 3) + noise(rng, v))
    first = next(iter(seen.values()))
    assert first.view == "experiment"
    assert first.chance < 0.01
    assert np.argmax(first.error) == 3
    assert "s1_003_steps" in first.text


def test_more_noise_in_one_experiment_is_seen_by_its_size():
    seen = found(lambda i, u, v, rng: noise(rng, v, 1.0 if i == 3 else 0.2))
    assert real(seen) == ["size by experiment"]


def test_an_error_in_one_kind_of_experiment_is_seen_by_kind():
    assert "kind of experiment" in real(found(lambda i, u, v, rng: 0.3 * (i % 2) + noise(rng, v)))


def test_a_bias_is_an_offset_and_nothing_else():
    assert real(found(lambda i, u, v, rng: 0.5 + noise(rng, v))) == ["offset"]


def test_a_vibration_is_seen_by_frequency():
    seen = found(lambda i, u, v, rng: 0.5 * np.sin(2 * np.pi * 2.0 * DT * np.arange(len(v))) + noise(rng, v))
    assert next(iter(seen)) == "frequency band"
    assert "between 1.25 and 2.5 Hz (0.25 to 0.5 of the Nyquist frequency)" in seen["frequency band"].text


def test_a_level_is_seen_by_its_value():
    assert next(iter(found(lambda i, u, v, rng: v**2 + noise(rng, v), "level"))) == "level"


def test_a_velocity_is_also_held_against_the_position_beside_it():
    experiments, simulated, _ = runs(lambda i, u, v, rng: noise(rng, v))
    channels = Channels(
        (Channel("u", "V"),), (Channel("omega", "deg/s", "velocity"), Channel("phi", "deg", "position"))
    )
    both = [np.hstack([s, DT * np.cumsum(s, axis=0)]) for s in simulated]
    measured = []
    for x, y_hat in zip(experiments, both, strict=True):
        y = np.vstack([np.zeros((N_INIT, 2)), y_hat])
        y[N_INIT:, 0] += np.sign(y_hat[:, 1])
        measured.append(Experiment(x.name, x.u, y, DT))
    seen = views(measured, both, channels, N_INIT)
    assert {view.output for view in seen} == {"omega"}  # phi is simulated exactly
    assert (seen[0].view, seen[0].channel) == ("position", "phi")


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize(("n", "samples"), [(8, 200), (1, 200), (1, 1000)])
def test_noise_passes_for_an_effect_no_more_often_than_promised(rho, n, samples):
    def coloured(i, u, v, rng):
        return lfilter([1], [1, -rho], rng.normal(size=len(v) + 100))[100:]

    p_values = []
    for seed in range(20):
        kind = ("velocity", "position", "level")[seed % 3]
        p_values += [
            view.chance
            for view in views(*runs(coloured, kind, n, samples, seed), N_INIT)
            if rho == 0 or view.view != "frequency band"  # which says, rightly, that this noise is not white
        ]
    assert np.mean(np.array(p_values) < 0.01) < 0.03


def test_an_exact_simulation_has_no_views():
    assert not found(lambda i, u, v, rng: np.zeros(len(v)))


def test_a_constant_error_is_an_offset_alone():
    (view,) = found(lambda i, u, v, rng: np.full(len(v), 0.25)).values()
    assert (view.view, view.share) == ("offset", 1.0)
    assert view.text == "The simulation of phi is 0.25 deg/s too low on average: 100 % of its squared error."


def test_a_simulation_that_diverged_is_left_out():
    experiments, simulated, channels = runs(lambda i, u, v, rng: noise(rng, v))
    rest = views(experiments[1:], simulated[1:], channels, N_INIT)
    for bad in (np.nan, np.inf, 1e200):
        assert views(experiments, [np.full_like(simulated[0], bad), *simulated[1:]], channels, N_INIT) == rest
    assert views(experiments[:1], [np.full_like(simulated[0], np.nan)], channels, N_INIT) == []


def test_the_same_seed_gives_the_same_views():
    given_runs = runs(lambda i, u, v, rng: noise(rng, v))
    assert views(*given_runs, N_INIT, seed=3) == views(*given_runs, N_INIT, seed=3)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(1, 70), min_size=1, max_size=4),
    st.sampled_from(["velocity", "position", "level", "other"]),
    st.sampled_from(["white", "walk", "steps", "one", "tiny", "huge"]),
    st.sampled_from(["noise", "binary", "constant"]),
    st.integers(0, 5),
)
@example([30], "position", "white", "noise", 0)
def test_short_records_of_any_kind_have_views_without_nan(lengths, kind, error, drive, seed):
    rng = np.random.default_rng(seed)
    experiments, simulated = [], []
    for i, n in enumerate(lengths):
        u = {"noise": rng.normal(size=n), "binary": rng.choice([-5.0, 5.0], n), "constant": np.ones(n)}[drive]
        e = {"white": rng.normal(size=n), "walk": np.cumsum(rng.normal(size=n)), "steps": np.floor(rng.normal(size=n)),
             "one": 1.0 * (np.arange(n) == n // 2), "tiny": 1e-140 * rng.normal(size=n),
             "huge": 1e98 * rng.normal(size=n)}[error]  # fmt: skip
        y_hat = np.zeros(n) if error == "tiny" else simulate(u, kind)
        y = np.concatenate([np.zeros(N_INIT), y_hat + e])
        experiments.append(Experiment(f"x{i}", np.concatenate([np.zeros(N_INIT), u])[:, None], y[:, None], DT))
        simulated.append(y_hat[:, None])
    channels = Channels((Channel("u"),), (Channel("y", "", kind),))
    seen = views(experiments, simulated, channels, N_INIT)
    assert [view.share for view in seen] == sorted((view.share for view in seen), reverse=True)
    for view in seen:
        assert 0 <= view.share <= 1
        assert 0 <= view.chance <= 1
        assert len(view.at) == len(view.error) > 0
        assert all(map(math.isfinite, view.at + view.error))
        assert "nan" not in view.text
        assert "  " not in view.text
