"""Whatever is done to good files, `load` gives a data set or one sentence, never another exception."""

import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simgap.data import load
from simgap.records import Dataset, UnusableInput

CELLS = st.sampled_from(["", " ", "nan", "inf", "1e999", "1_0", "abc", '"', "0", "-0.0", "1e-320", "\ufeff", "٣", ";"])
VALUES = st.sampled_from(["0", "-1", "1e308", "nan", "true", '""', "[]", "{}", "[[]]", "1979-05-27", '"../*"', "'**'"])
FILES = st.sampled_from(["dataset.toml", "train/000.csv", "valid/002.csv", "test/003.csv"])


@st.composite
def mutations(draw):
    """A function from the bytes of a file to other bytes."""
    kind = draw(st.sampled_from(["byte", "cell", "cut", "lines", "column", "value", "insert", "random"]))
    number, cell, value = draw(st.integers(0, 10**6)), draw(CELLS), draw(VALUES)
    noise = draw(st.binary(max_size=60))

    def mutate(content: bytes) -> bytes:
        lines = content.split(b"\n")
        at = number % len(lines)
        cells = lines[at].split(b",")
        if kind == "byte":
            at = number % (len(content) or 1)
            return content[:at] + noise[:1] + content[at + 1 :]
        if kind == "cell":
            cells[number % len(cells)] = cell.encode()
            lines[at] = b",".join(cells)
        elif kind == "cut":
            return content[: number % (len(content) + 1)]
        elif kind == "lines":
            lines = lines[:at] + lines[at + 1 :] if number % 2 else [*lines[:at], lines[at], *lines[at:]]
        elif kind == "column":
            lines = [line + b"," + line.split(b",")[number % 3 % (line.count(b",") + 1)] for line in lines]
        elif kind == "value":
            lines[at] = lines[at].split(b"=")[0] + b"=" + value.encode()
        elif kind == "insert":
            lines.insert(at, noise)
        else:
            return noise
        return b"\n".join(lines)

    return mutate


def accepted_or_refused(*arguments, **named) -> None:
    try:
        assert isinstance(load(*arguments, **named), Dataset)
    except UnusableInput as error:
        assert len(str(error).splitlines()) == 1


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(broken=st.lists(st.tuples(FILES, mutations()), min_size=1, max_size=3))
def test_a_broken_folder_is_loaded_or_refused_in_one_line(good, broken):
    with tempfile.TemporaryDirectory() as place:
        folder = shutil.copytree(good, Path(place) / "set")
        for name, mutate in broken:
            (folder / name).write_bytes(mutate((folder / name).read_bytes()))
        accepted_or_refused(folder)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(mutate=st.lists(mutations(), min_size=1, max_size=3), dt=st.sampled_from([None, 0.1]))
def test_a_broken_csv_file_is_loaded_or_refused_in_one_line(good, mutate, dt):
    content = (good / "train" / "000.csv").read_bytes()
    for mutation in mutate:
        content = mutation(content)
    file = good / "broken.csv"
    file.write_bytes(content)
    accepted_or_refused(file, ["u"], ["phi"], dt=dt)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.one_of(st.binary(max_size=300), st.text(alphabet="[]{}\"'=.,#\n\r\0 au1_", max_size=200)))
def test_any_bytes_are_refused_in_one_line(good, content):
    raw = content if isinstance(content, bytes) else content.encode()
    (good / "any.csv").write_bytes(raw)
    accepted_or_refused(good / "any.csv", ["a"], ["u"], dt=1.0)
    (good / "dataset.toml").write_bytes(raw)
    accepted_or_refused(good)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pattern=st.text(alphabet="*?[]!./\\~-a0: \0é", max_size=12))
def test_any_pattern_is_followed_inside_the_folder_or_refused(good, pattern):
    text = (good / "dataset.toml").read_text()
    quoted = "".join(f"\\u{ord(letter):04x}" for letter in pattern)
    with tempfile.TemporaryDirectory() as place:
        folder = shutil.copytree(good, Path(place) / "set")
        (folder / "dataset.toml").write_text(text.replace("train/*.csv", quoted))
        accepted_or_refused(folder)


def test_brackets_nested_too_deeply_for_the_parser_are_refused(good):
    (good / "dataset.toml").write_text("a = " + "[" * 100_000)
    with pytest.raises(UnusableInput, match="nested too deeply"):
        load(good)
