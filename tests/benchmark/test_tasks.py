import numpy as np
import pytest

from simgap.records import Channels, Experiment, UnusableInput
from simgap.tasks import Differences, Evaluation, Forecast, FreeRun

CHANNELS = Channels.unnamed(1, 1)


def ramp(length):
    return Experiment("ramp", np.zeros((length, 1)), np.arange(float(length))[:, None], 1.0)


class Hold:
    """Repeats the last measured output, and remembers what it was asked."""

    def __init__(self):
        self.asked = []

    def __call__(self, u, y_init):
        self.asked.append((u.shape, y_init.copy()))
        return np.repeat(y_init[:, -1:], u.shape[1] - y_init.shape[1], axis=1)


def evaluation(length, n_init=3):
    return Evaluation(Hold(), ramp(length), n_init, CHANNELS)


def test_a_free_run_sees_all_inputs_and_only_the_first_outputs():
    run = evaluation(20)
    outcome = FreeRun().score(run)
    ((shape, y_init),) = run.simulate.asked
    assert shape == (1, 20, 1)
    assert y_init.ravel().tolist() == [0, 1, 2]
    assert outcome.metrics["y0"]["n_scored"] == 17
    assert outcome.metrics["y0"]["rmse"] == pytest.approx(np.sqrt(np.mean(np.arange(1, 18.0) ** 2)))


def test_a_forecast_of_a_held_ramp_errs_by_its_horizon():
    figures = Forecast().score(evaluation(200)).metrics["y0"]
    horizons = figures["rmse_by_horizon"]
    assert {h: e for h, e in horizons.items() if h != "all"} == {str(h): h for h in (1, 2, 5, 10, 20, 50)}
    assert horizons["all"] == FreeRun().score(evaluation(200)).metrics["y0"]["rmse"]


def test_forecast_windows_are_at_most_1000_and_reach_from_the_first_to_the_last():
    run = evaluation(5000)
    Forecast().score(run)
    shape, y_init = run.simulate.asked[0]
    assert shape == (1000, 53, 1)
    assert y_init[0, 0, 0] == 0
    assert y_init[-1, 0, 0] == 5000 - 53


def test_horizons_longer_than_the_record_are_left_out():
    horizons = Forecast().score(evaluation(12)).metrics["y0"]["rmse_by_horizon"]
    assert list(horizons) == ["1", "2", "5", "all"]


def test_a_record_with_one_sample_to_score_still_has_a_forecast():
    assert list(Forecast().score(evaluation(4)).metrics["y0"]["rmse_by_horizon"]) == ["1", "all"]


def test_both_tasks_share_one_free_run():
    run = evaluation(100)
    FreeRun().score(run)
    Forecast().score(run)
    assert len(run.simulate.asked) == 2


@pytest.mark.parametrize("horizons", [(), (2, 5), (1, 5, 2), (1, 1)])
def test_horizons_that_do_not_increase_from_one_are_refused(horizons):
    with pytest.raises(UnusableInput, match="must start at 1"):
        Forecast(horizons=horizons)


def test_differences_start_at_the_last_measured_sample():
    run = evaluation(20)
    figures = Differences().score(run).metrics["y0"]
    assert figures["n_scored"] == 17
    assert figures["rmse"] == pytest.approx(1.0)  # held differences are zero, those of the ramp are one
