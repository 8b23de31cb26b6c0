"""Hum in several records, none of which begins in step with it: it is named, and no swing is taken for it."""

import numpy as np
import pytest
from scipy.signal import TransferFunction, lsim

from simgap.diagnosis.diagnose import diagnose
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet
from simgap.saved.archive import read_saved, save_model

DT, SUBSTEPS, HERTZ = 0.02, 10, 1.37
CHANNELS = Channels((Channel("voltage", "V"),), (Channel("speed", "rad/s", kind="velocity", kind_from="written"),))


def dataset(lengths, seed=0, hum=0.0, friction=0.0, damping=None):
    """Split records of these lengths into the last one for the test, those before it, a third, for validation.

    `hum` and `friction` in rad/s^2; with a `damping` ratio, a light mode swings beside the motor from where it begins.
    """
    rng = np.random.default_rng(seed)
    records = []
    for number, samples in enumerate(lengths):
        voltage = np.repeat(rng.uniform(-5.0, 5.0, samples // 40 + 1), 40)[:samples]
        t, u = DT / SUBSTEPS * np.arange(samples * SUBSTEPS), np.repeat(voltage, SUBSTEPS)
        pushed = 8.0 * u + hum * np.sin(2 * np.pi * HERTZ * t + rng.uniform(0.0, 2 * np.pi))
        speed = np.zeros(len(t))
        for k in range(1, len(t)):
            moved = speed[k - 1] + DT / SUBSTEPS * (pushed[k - 1] - speed[k - 1] / 0.4)
            speed[k] = np.sign(moved) * max(abs(moved) - DT / SUBSTEPS * friction, 0.0)
        if damping is not None:
            w = 2 * np.pi * HERTZ
            mode = TransferFunction([w**2], [1.0, 2 * damping * w, w**2])
            speed += lsim(mode, u, t, X0=rng.standard_normal(2))[1]
        y = speed[::SUBSTEPS]
        y = y + 0.02 * y.std() * rng.standard_normal(samples)
        records.append(Experiment(f"e{number}", voltage[:, None], y[:, None], DT))
    valid = max(1, (len(records) - 1) // 3)
    train, held_out = records[: -1 - valid], records[-1 - valid : -1]
    training = TrainingSet(tuple(train), tuple(held_out), 20, CHANNELS)
    return Dataset("motor", training, (records[-1],), 20, CHANNELS)


@pytest.mark.parametrize("lengths", [[800] * 6, [800] * 4, [800] * 3, [400, 1500, 700, 900, 300, 1000]])
def test_hum_of_any_phase_is_named_with_its_frequency_and_amplitude(lengths):
    (cause,) = diagnose(dataset(lengths, hum=8.0), views_too=False).findings.causes
    assert cause.effect == "periodic_disturbance" and cause.per_experiment
    amplitude, frequency = cause.parameters
    assert amplitude.value == pytest.approx(8.0, rel=0.03)
    assert frequency.low < HERTZ < frequency.high and frequency.high - frequency.low < 0.01


def test_beside_hum_a_friction_has_its_true_size():
    """Without the hum, friction would be named with more than twice that: it would have to stand for both."""
    found = diagnose(dataset([800] * 8, hum=8.0, friction=6.0), views_too=False).findings
    sizes = {cause.effect: cause.parameters[0].value for cause in found.causes}
    assert set(sizes) == {"coulomb_friction", "periodic_disturbance"}
    assert sizes["coulomb_friction"] == pytest.approx(6.0, rel=0.05)


@pytest.mark.parametrize(
    ("damping", "seed"),
    [(0.002, 0), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((0.01, 0), (0.002, 1)))],
)
def test_a_light_mode_that_inputs_and_starts_excite_is_no_hum(damping, seed):
    found = diagnose(dataset([800] * 6, seed, damping=damping), views_too=False).findings
    assert "periodic_disturbance" not in {cause.effect for cause in found.effects + found.suspects}


def test_a_saved_model_with_hum_of_any_phase_simulates_as_before(tmp_path):
    data = dataset([800] * 4, hum=8.0)
    model = diagnose(data, views_too=False).model
    save_model(model, tmp_path / "motor.simgap", data)
    read = read_saved(tmp_path / "motor.simgap").model
    x, n = data.test[0], data.n_init
    for before, after in ((model.simulate(x.u[None], x.y[None, :n]), read.simulate(x.u[None], x.y[None, :n])),
                          (model.simulate_anew(x, n), read.simulate_anew(x, n))):  # fmt: skip
        np.testing.assert_array_equal(after, before)
    assert np.std(x.y[n:] - model.simulate_anew(x, n)) < 0.4 * np.std(
        x.y[n:] - model.simulate(x.u[None], x.y[None, :n])[0]
    )


def test_without_hum_nothing_is_said():
    assert diagnose(dataset([800] * 6), views_too=False).findings.causes == ()
