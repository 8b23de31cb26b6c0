"""Pandas reads long plain CSV files, the strict reader all others: one answer, to the bit and to the word."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from simgap.data import load
from simgap.data.formats.csv_files import LONG, plain_table
from simgap.data.formats.strict_csv import strict_table
from simgap.records import UnusableInput

NUMBERS = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.integers(-(10**25), 10**25).map(str),
    st.text("0123456789", min_size=1, max_size=40).map(lambda digits: f"0.{digits}"),
    st.sampled_from(["1e999", "-0", " 1", "1 ", "+5", "5.", ".5", "4.9e-324", "2.4703282292062328e-324", "1e-400"]),
    st.text("0123456789+-.eE ", max_size=6),
)
ODD = st.sampled_from(["", ",", "\n", "\r", '"', "\t", "\0", "x", "nan", "1_0", "٣", "\ufeff"])


def answer(read, content: bytes):
    """What the reader makes of the file: the bytes of each column or the sentence about it; None for no answer."""
    try:
        table = read(Path("log.csv"), content)
    except UnusableInput as error:
        return str(error)
    if table is None:
        return None
    columns = []
    for name in table.names:
        try:
            columns.append(table.numbers(name).tobytes())
        except UnusableInput as error:
            columns.append(str(error))
    return table.source, table.names, table.first_row, len(table), columns


@settings(max_examples=1000, deadline=None)
@given(
    rows=st.lists(st.tuples(NUMBERS, NUMBERS), max_size=8),
    ending=st.sampled_from(["\n", "\r\n", "\r"]),
    last=st.integers(0, 2),
    odd=st.one_of(st.just(""), ODD),
    where=st.floats(0, 1),
)
@example(rows=[("0.0", "+0E 0")], ending="\n", last=0, odd="", where=0.0)
@example(rows=[("0.0", "1 e3")], ending="\n", last=0, odd="", where=0.0)
def test_both_readers_give_one_answer(rows, ending, last, odd, where):
    text = ending.join(["u, phi", *(",".join(row) for row in rows)]) + last * ending
    at = round(where * len(text))
    content = (text[:at] + odd + text[at:]).encode()
    fast = answer(plain_table, content)
    assert fast is None or fast == answer(strict_table, content)


@pytest.fixture(scope="module")
def lines() -> list[str]:
    """A header and as many rows as make the file a long one."""
    values = np.random.default_rng(0).normal(size=(LONG // 40, 2)).tolist()
    return ["t,u,phi", *(f"{k / 100!r},{u!r},{phi!r}" for k, (u, phi) in enumerate(values))]


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_a_long_plain_file_is_left_to_pandas(lines, ending, tmp_path, monkeypatch):
    content = (ending.join(lines) + ending).encode()
    assert answer(plain_table, content) == answer(strict_table, content)
    monkeypatch.setattr("simgap.data.formats.csv_files.strict_table", None)
    (tmp_path / "log.csv").write_bytes(content)
    assert load(tmp_path / "log.csv", ["u"], ["phi"]).training.dt == 0.01


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("59.99,,1", "column 'u': the cell is empty"),
        ("59.99,nan,1", "column 'u': 'nan' is no measurement"),
        ("59.99,1e999,1", "column 'u': inf is no measurement"),
        ("59.99,1 2,1", "column 'u': '1 2' is not a number"),
        ("59.99,1", "ends before column 'phi'"),
        ("59.99,1,2,3", "has one more cell after column 'phi', which has no name; name it, or remove it"),
        ("", "is empty; delete it"),
        (f"59.99,{'0' * 131_072}1,1", "is no CSV: field larger than field limit"),
    ],
)
def test_a_fault_in_a_long_file_is_named_as_in_a_short_one(lines, row, said, refused_cell):
    broken = [*lines[:6000], row, *lines[6001:]]
    assert said in refused_cell("\n".join(broken), row=6001, column=None)
