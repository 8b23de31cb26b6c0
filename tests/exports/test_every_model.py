"""Every registered model in every format: it repeats our free run, or is refused with a sentence."""

import re
import warnings
from functools import cache
from pathlib import Path

import pytest

from simgap.contract import N_INIT, candidate, toy_experiment
from simgap.exports import export as exports
from simgap.exports.export import FORMATS, check_target, export, refusal
from simgap.records import Dataset, TrainingSet, UnusableInput
from simgap.registry import MODELS
from simgap.saved.archive import FittedOn, SavedModel

AT_HAND = [name for name in MODELS if not MODELS.why_missing(name)]
TABLE = (Path(exports.__file__).parent / "README.md").read_text(encoding="utf-8")
TRAINING = TrainingSet(tuple(toy_experiment(i, 250) for i in range(2)), (toy_experiment(2, 100),), N_INIT)
TOY = Dataset("toy", TRAINING, (toy_experiment(9, 90),), N_INIT, TRAINING.channels)


def table():
    """model -> format -> yes or no, as the README has it."""
    header, *rows = re.findall(r"^\|(.*)\|$", TABLE.partition("## Which model")[2].partition("\n## ")[0], re.MULTILINE)
    formats = re.findall(r"`(\w+)`", header)
    cells = [row.split("|") for row in rows[1:]]
    return {
        model: dict(zip(formats, (cell.strip() for cell in of_row[1:]), strict=True))
        for of_row in cells for model in re.findall(r"`([\w-]+)`", of_row[0])
    }  # fmt: skip


def test_the_table_of_the_readme_says_what_applies():
    applies = {
        name: {form: "no" if refusal(name, MODELS[name], form) else "yes" for form in FORMATS} for name in AT_HAND
    }
    assert table() == {name: formats for name, formats in applies.items() if "yes" in formats.values()}


@pytest.mark.parametrize("name", AT_HAND)
def test_a_format_that_does_not_apply_is_refused_in_a_sentence_that_names_what_does(name):
    for form in FORMATS:
        if reason := refusal(name, MODELS[name], form):
            assert re.fullmatch(
                rf"{name} cannot be exported to {form}: .+; (it can be to .+|no other format .+)", reason
            )


@cache
def fitted(name):
    params = {"epochs": 1, "batches": 2} if hasattr(MODELS[name], "epochs") else {}
    model = candidate(name, params).build()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what a fit says of toy data
        model.fit(TRAINING, 0)
    return SavedModel(name, model, FittedOn.of(TOY))


def repeats(name, forms, folder):
    saved = fitted(name)
    for form in forms:
        if refusal(name, type(saved.model), form) or form in ("mjcf", "urdf"):
            continue
        try:
            check_target(form, folder / "new")
        except UnusableInput as error:
            pytest.skip(str(error))
        done = export(saved, TOY, form, folder / form)
        assert done.passed, f"{name}: {done}"


QUICK = [(name, form) for name in ("arx", "greybox", "gru") for form in FORMATS if form not in ("mjcf", "urdf")]


@pytest.mark.parametrize(("name", "form"), QUICK)
def test_an_export_repeats_our_free_run(name, form, tmp_path):
    repeats(name, [form], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", AT_HAND)
def test_every_model_repeats_our_free_run_in_every_format(name, tmp_path):
    repeats(name, FORMATS, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in AT_HAND if hasattr(MODELS[name], "window")])
def test_every_network_on_windows_does_so_too(name, tmp_path):
    model = MODELS[name](mode="windowed", epochs=1, batches=2)
    model.fit(TRAINING, 0)
    for form in ("c", "onnx"):
        assert export(SavedModel(name, model, FittedOn.of(TOY)), TOY, form, tmp_path / form).passed
