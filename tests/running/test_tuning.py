"""`simgap tune`: settings are chosen by validation data within a time, and the test has no part in it."""

import json
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import simgap
from simgap.cli import main
from simgap.data.simulated.gimbal.recordings import gimbal_short
from simgap.records import UnusableInput
from simgap.running.fitting import validation_error
from simgap.running.tuning import Range, tune

ORDERS = [Range("na", 1, 3), Range("nb", 1, 2), Range("nk", choices=(1,))]


@pytest.fixture(scope="module")
def dataset():
    return gimbal_short()


def test_it_keeps_the_settings_that_err_least_on_validation_data_and_tries_each_once(dataset):
    tuned = tune("arx", dataset, ORDERS, seconds=60.0, params={"na": 1, "nb": 1, "nk": 1})
    assert len(tuned.trials) == 6  # all that there are, in far less than the time
    errors = {}
    for na in (1, 2, 3):
        for nb in (1, 2):
            model = simgap.MODELS["arx"](na=na, nb=nb, nk=1)
            model.fit(dataset.training, 0)
            errors[na, nb] = validation_error(model, dataset.training)
    best = min(errors, key=errors.get)
    assert (tuned.best.params["na"], tuned.best.params["nb"]) == best
    assert tuned.best.error == errors[best]


def test_the_test_has_no_part_in_it(dataset):
    noise = tuple(replace(x, y=np.random.default_rng(0).normal(size=x.y.shape)) for x in dataset.test)
    without = replace(dataset, test=noise, sha256="0" * 64)
    one, other = (tune("arx", data, ORDERS, seconds=60.0).best for data in (dataset, without))
    assert (one.params, one.error) == (other.params, other.error)


PICKY = '''
import numpy as np


class Picky:
    """A constant that cannot be fitted unless it is told a number below 3."""

    def __init__(self, number: int = 5):
        self.number = number

    def fit(self, data, seed):
        if self.number > 2:
            raise RuntimeError("no luck")
        self.level = self.number + seed

    def simulate(self, u, y_init):
        return np.full((len(u), u.shape[1] - y_init.shape[1], y_init.shape[2]), float(self.level))
'''


@pytest.fixture
def picky(tmp_path):
    (tmp_path / "picky.py").write_text(PICKY)
    return f"{tmp_path / 'picky.py'}:Picky"


def test_settings_that_no_fit_stands_are_passed_over(picky, dataset):
    tuned = tune(picky, dataset, [Range("number", 1, 4)], seconds=60.0)
    assert tuned.trials[0].error == math.inf  # as it is
    assert tuned.best.params["number"] in (1, 2)
    with pytest.raises(UnusableInput, match="with none of these settings"):
        tune(picky, dataset, [Range("number", 3, 9)], seconds=60.0)


def test_the_median_of_several_seeds_counts(picky, dataset):
    tuned = tune(picky, dataset, [Range("number", choices=(1,))], seconds=60.0, seeds=3)
    middle = tune(picky, dataset, [Range("number", choices=(1,))], seconds=60.0, seed=1)
    assert tuned.best.error == middle.best.error


def test_the_command_writes_a_suite_that_runs_and_says_what_it_gained(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["tune", "arx", "gimbal_short", "--range", "na=1:2", "--range", "nb=2,3", "--range", "nk=1,2",
                 "--param", "select=aic", "--seconds", "5", "--json", "told.json"]) == 0  # fmt: skip
    assert "% of the spread, seed 0" in capsys.readouterr().out
    suite = tomllib.loads((tmp_path / "tuned.toml").read_text())
    told = json.loads((tmp_path / "told.json").read_text())
    assert suite["models"][0]["params"] == told["best"]
    assert told["best"]["select"] == "aic"
    rows = simgap.run("tuned.toml", out=tmp_path / "out")
    assert {(row.model, row.status) for row in rows} == {("arx tuned", "ok")}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--range", "na"], "--range na: write it as name=low:high or name=one,other"),
        (["--range", "na=1:two"], "write it as name=low:high"),
        (["--range", "na=3:1"], "na has no range from 3 to 1"),
        (["--range", "order=1:3"], "arx: got an unexpected keyword argument 'order'"),
        (["--range", "na=0.5:1.5"], "arx: na = 0.5, where a whole number or a list or null is needed"),
        ([], "tuning needs a range"),
        (["--range", "na=1:3", "--seconds", "0"], "a time above zero"),
    ],
)
def test_what_cannot_be_tuned_is_refused_in_a_sentence(given, words, capsys):
    assert main(["tune", "arx", "gimbal_short", *given]) == 2
    assert words in capsys.readouterr().err


def test_without_validation_data_there_is_nothing_to_tune_by(dataset):
    training = replace(dataset.training, valid=())
    with pytest.raises(UnusableInput, match="has no validation data"):
        tune("arx", replace(dataset, training=training, sha256="0" * 64), ORDERS, seconds=1.0)


def test_a_table_among_the_settings_is_written_as_one(dataset):
    order = {"na": 2, "nb": 2, "nk": 1}
    tuned = tune("delta", dataset, [Range("model", choices=("arx",))], seconds=1.0, params={"params": order})
    assert tomllib.loads(tuned.to_suite("mine"))["models"][0]["params"]["params"] == order
