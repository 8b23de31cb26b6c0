import math
import multiprocessing
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simgap.records import Result, UnusableInput
from simgap.results import store
from simgap.results.decoding import StoredRow, decode

RESULT = Result(
    model="arx", params={"na": 2}, dataset="tanks", experiment="test", task="free_run", seed=0,
    status="diverged",
    metrics={"y": {"rmse": math.inf, "fit_percent": -math.inf, "n_scored": 9, "std": 1.5, "rmse_by_horizon": {"1": 0.1}}
             },
    units={"y": "°"}, fitted={"text": "inf"}, n_params=4, fit_seconds=0.1, message="a\nb",
)  # fmt: skip


def file_with(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "arx.jsonl"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_result_comes_back_as_it_went_in(tmp_path):
    store.append(tmp_path, "smoke", [RESULT])
    assert store.read(tmp_path / "smoke" / "arx.jsonl") == [RESULT]
    assert store.read(tmp_path / "smoke") == [RESULT]


def test_lines_are_strict_json_without_infinity(tmp_path):
    line = store.encode(RESULT)
    assert '"rmse": "inf", "fit_percent": "-inf"' in line
    assert "\n" not in line


def test_numpy_values_and_strange_objects_are_stored_as_plain_json():
    value = {"a": np.arange(2), "b": np.float64("nan"), 3: {1}, "c": Path("x"), "d": (np.bool_(True), None)}
    assert store.plain(value) == {"a": [0, 1], "b": "nan", "3": [1], "c": "x", "d": [True, None]}


def test_of_two_results_with_one_key_the_later_wins(tmp_path):
    later = replace(RESULT, status="ok")
    other = replace(RESULT, seed=1)
    store.append(tmp_path, "smoke", [RESULT, other])
    store.append(tmp_path, "smoke", [later])
    assert store.read(tmp_path / "smoke") == [later, other]


def test_the_order_of_parameters_does_not_make_another_key():
    first, second = replace(RESULT, params={"a": 1, "b": 2}), replace(RESULT, params={"b": 2, "a": 1})
    assert store.key(first) == store.key(second)


def test_a_torn_last_line_is_ignored_and_cut_before_the_next_write(tmp_path):
    path = store.path_of(tmp_path, "smoke", "arx")
    store.append(tmp_path, "smoke", [RESULT])
    with path.open("ab") as file:
        file.write(store.encode(replace(RESULT, seed=1)).encode()[:-30] + "°".encode()[:1])
    assert store.read(path) == [RESULT]
    store.append(tmp_path, "smoke", [replace(RESULT, seed=2)])
    assert [row.seed for row in store.read(path)] == [0, 2]


def test_a_last_line_without_its_line_break_still_counts(tmp_path):
    path = file_with(tmp_path, store.encode(RESULT))
    assert store.read(path) == [RESULT]
    (tmp_path / "s").mkdir()
    path = path.rename(tmp_path / "s" / "arx.jsonl")
    store.append(tmp_path, "s", [replace(RESULT, seed=1)])
    assert [row.seed for row in store.read(path)] == [0, 1]


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (('"seed": 0', '"seed": 0, "score": 1'), "unknown field 'score'"),
        (('"seed": 0, ', ""), "the field 'seed' is missing"),
        (('"seed": 0', '"seed": true'), "seed is a bool"),
        (('"seed": 0', '"seed": "0"'), "seed is a str"),
        (('"status": "diverged"', '"status": "fine"'), "status 'fine'"),
        (('"schema": 1', '"schema": 2'), "schema 2"),
        (('"n_scored": 9', '"n_scored": "many"'), "metric 'n_scored'"),
        (('"n_scored": 9', '"n_scored": NaN'), "NaN is not JSON"),
        (('"metrics": {"y": {', '"metrics": {"z": 1, "y": {'), "metrics of an output"),
        (('"rmse": "inf", ', ""), "lack the number rmse"),
        (('"1": 0.1', '"1": "far"'), "the metric '1' is 'far', which is no number"),
        (('"n_params": 4', '"n_params": ' + "9" * 400), "n_params is larger than it can be"),
        (('"n_scored": 9', '"n_scored": 1e999'), "out of range"),
        (('"y": "°"', '"y": 3'), "the units of outputs are texts"),
        (('{"model"', '[{"model"'), "no line of results"),
        (('{"model"', "[" * 100_000), "no line of results"),
    ],
)
def test_a_bad_line_is_refused_with_file_and_line(tmp_path, change, complaint):
    bad = store.encode(RESULT).replace(*change)
    path = file_with(tmp_path, store.encode(RESULT) + "\n" + bad + "\n")
    with pytest.raises(UnusableInput) as refusal:
        store.read(path)
    assert str(refusal.value).startswith(f"{path}, line 2: ")
    assert complaint in str(refusal.value)


def test_the_fields_of_a_line_are_those_of_a_result():
    assert list(StoredRow.__struct_fields__) == [field.name for field in fields(Result)]
    defaults = Result("m", {}, "d", "e", "t", 0, "ok")
    assert decode(store.encode(defaults).encode(), "line 1") == defaults


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers())
def test_numbers_come_back_to_the_bit_and_of_their_type(number):
    row = replace(RESULT, metrics={"y": {"rmse": 1.0, "mae": number}}, fitted={"value": number})
    line = store.encode(row)
    back = decode(line.encode(), "line 1")
    assert (repr(back.metrics["y"]["mae"]), repr(back.fitted["value"])) == (repr(number), repr(number))
    assert store.encode(back) == line


@pytest.mark.parametrize("name", ["../../etc/passwd", "a/b\\c", "..", "C:x", ".hidden", "ARX(3,2,1)", "", "x\n"])
def test_no_model_name_leaves_the_suite_folder(tmp_path, name):
    path = store.path_of(tmp_path, name, name)
    assert path.resolve().parent.parent == tmp_path.resolve()
    assert path.name.isprintable()


def _append_many(folder: Path, seed: int) -> None:
    for i in range(20):
        store.append(folder, "smoke", [replace(RESULT, seed=seed + i)])


def test_two_processes_may_write_to_one_file(tmp_path):
    context = multiprocessing.get_context("fork")
    writers = [context.Process(target=_append_many, args=(tmp_path, seed)) for seed in (0, 100)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert len(store.read(tmp_path / "smoke")) == 40
