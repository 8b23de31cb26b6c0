import pytest

import simgap
from simgap.records import UnusableInput
from simgap.registry import MODELS
from simgap.running.fitting import build, check_params


def test_fit_returns_the_fitted_model_and_its_scores(dataset, example):
    done = simgap.fit(example("Scaled"), dataset, params={"factor": 2.0}, seed=5)
    assert done.model.factor == 2
    assert [(row.experiment, row.task) for row in done.results] == [
        ("first", "free_run"), ("first", "forecast"), ("second", "free_run"), ("second", "forecast"),
    ]  # fmt: skip
    assert done.results[0].params == {"factor": 2.0}
    assert done.results[0].fitted["seed"] == 5


def test_fit_takes_what_load_takes(folder, example):
    assert simgap.fit(example("Mean"), folder).results[0].dataset == "noise"


def test_the_seconds_of_an_interrupted_fit_count(dataset, example):
    assert simgap.fit(example("CarriedOn"), dataset).results[0].fit_seconds > 1000


@pytest.mark.parametrize(("outer", "params"), [("delta", {"model": "mean"}), ("ensemble", {"models": ["mean"]})])
def test_the_seconds_of_an_interrupted_fit_count_within_another_model(outer, params, dataset, monkeypatch):
    monkeypatch.setattr(MODELS["mean"], "earlier_seconds", 1000.0, raising=False)
    assert simgap.fit(outer, dataset, params=params).results[0].fit_seconds > 1000


def test_fit_raises_what_the_model_raises(dataset, example):
    with pytest.raises(RuntimeError, match="no luck"):
        simgap.fit(example("RaisesInFit"), dataset)


def test_an_unknown_parameter_is_refused_with_the_known_ones(example):
    with pytest.raises(UnusableInput, match="unexpected keyword argument 'fctor'; its parameters are factor"):
        build(example("Scaled"), {"fctor": 1})
    check_params(example("Scaled"), {"factor": 1})


@pytest.mark.parametrize(
    ("model", "params", "words"),
    [
        ("subnet", {"pairs": "x"}, "subnet: pairs = 'x', where a whole number is needed"),
        ("arx", {"na": 2.5}, "arx: na = 2.5, where a whole number or a list or null is needed"),
        ("gru", {"mode": "dreamt"}, "gru: mode = 'dreamt', where windowed or stateful is needed"),
        ("gru", {"learning_rate": "fast"}, "gru: learning_rate = 'fast', where a number is needed"),
        ("gru", {"resident": 1}, "gru: resident = 1, where true or false is needed"),
    ],
)
def test_a_parameter_of_another_type_is_refused_in_words(model, params, words):
    with pytest.raises(UnusableInput) as refused:
        check_params(model, params)
    assert str(refused.value) == words


@pytest.mark.parametrize(
    ("model", "params"),
    [
        ("gru", {"learning_rate": 1}),
        ("arx", {"na": [[2]]}),
        ("greybox", {"effects": "backlash"}),
        ("arx", {"na": None}),
    ],
)
def test_a_parameter_may_be_written_in_any_way_that_its_type_allows(model, params):
    check_params(model, params)


def test_a_model_whose_annotations_are_prose_runs_unchecked(tmp_path):
    (tmp_path / "prose.py").write_text('class Prose:\n    level: "any number" = 1.0\n' + "    fit = simulate = print\n")
    check_params(f"{tmp_path / 'prose.py'}:Prose", {})


def test_every_exported_name_exists():
    for name in simgap.__all__:
        assert getattr(simgap, name) is not None
    assert set(simgap.__all__) <= set(dir(simgap))
    with pytest.raises(AttributeError, match="no attribute 'nosuch'"):
        _ = simgap.nosuch
