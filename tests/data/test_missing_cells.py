"""Missing cells: refused with the option that cuts the record there, and cut with it."""

import numpy as np
import pandas as pd
import pytest

from simgap.data import read

N = 200
T = [f"{k / 10:.1f}" for k in range(N)]
DATES = [f"2024-05-01 12:{k // 600:02d}:{k // 10 % 60:02d}.{k % 10}" for k in range(N)]
REMEDY = "fill it in, or --split-gaps begins a new experiment after it (split_gaps=True in Python)"
COLUMNS = (["u"], ["y"])


def csv_text(cells: dict[tuple[int, str], str], t=T) -> str:
    columns = {"t": list(t), "u": [f"{k * 7 % 5}" for k in range(N)], "y": [f"{k}" for k in range(N)], "note": [""] * N}
    for (row, name), cell in cells.items():
        columns[name][row] = cell
    return "\n".join([",".join(columns), *map(",".join, zip(*columns.values(), strict=True))]) + "\n"


@pytest.fixture
def log(tmp_path):
    """Write a log with some cells replaced, where none are in a column that nobody names."""

    def write(cells, t=T):
        (tmp_path / "log.csv").write_text(csv_text(cells, t))
        return tmp_path / "log.csv"

    return write


def pieces(reading) -> list[list[float]]:
    data = reading.dataset
    return [part.y[:, 0].tolist() for part in (*data.training.train, *data.training.valid, *data.test)]


@pytest.mark.parametrize("cell", ["", " ", "NaN", "NA", "#N/A", "null"])
@pytest.mark.parametrize("name", ["u", "y", "t"])
def test_a_missing_cell_is_refused_with_the_option_that_cuts_there(log, refused, cell, name):
    sentence = refused(log({(20, name): cell}), *COLUMNS)
    assert f"row 22, column '{name}'" in sentence
    assert sentence.endswith(REMEDY)


@pytest.mark.parametrize("cell", ["", "NaN"])
@pytest.mark.parametrize("name", ["u", "y", "t"])
@pytest.mark.parametrize("t", [T, DATES])
def test_a_new_experiment_begins_after_a_missing_cell_and_that_is_said(log, cell, name, t):
    reading = read(log({(20, name): cell}, t), *COLUMNS, split_gaps=True)
    assert reading.said[-1] == "2 experiments of one file, cut at 1 row with missing cells"
    assert pieces(reading)[0] == list(range(20))
    assert [y for piece in pieces(reading) for y in piece] == [k for k in range(N) if k != 20]
    assert reading.dataset.training.dt == pytest.approx(0.1)


def test_gaps_and_missing_cells_are_counted_apart(log):
    t = [f"{k / 10 + 5 * (k >= 100):.1f}" for k in range(N)]
    reading = read(log({(40, "u"): "", (41, "y"): "nan", (60, "u"): ""}, t), *COLUMNS, split_gaps=True)
    assert reading.said[-1] == "4 experiments of one file, cut at 1 gap in column t and at 3 rows with missing cells"


def test_missing_cells_of_a_column_that_is_not_named_cut_nothing(log):
    assert read(log({}), *COLUMNS).dataset.sha256 == read(log({}), *COLUMNS, split_gaps=True).dataset.sha256


def test_a_fault_behind_missing_cells_is_named_by_its_row_in_the_file(log, refused):
    assert "row 102, column 'u'" in refused(log({(20, "u"): "", (100, "u"): "oops"}), *COLUMNS, split_gaps=True)
    assert "row 102, column 't'" in refused(log({(20, "u"): "", (100, "t"): "10.03"}), *COLUMNS, split_gaps=True)


def test_a_record_without_a_time_column_is_cut_too_where_the_sampling_time_is_given(tmp_path):
    lines = csv_text({(20, "y"): ""}).splitlines()
    (tmp_path / "log.csv").write_text("\n".join(line.partition(",")[2] for line in lines))
    reading = read(tmp_path / "log.csv", *COLUMNS, dt=0.1, split_gaps=True)
    assert reading.said == ("2 experiments of one file, cut at 1 row with missing cells",)
    assert len(pieces(reading)[0]) == 20


def test_a_frame_is_cut_where_it_holds_nan():
    frame = pd.DataFrame({"t": np.arange(N) * 0.1, "u": np.arange(N) * 7 % 5, "y": np.arange(N) * 1.0})
    frame.loc[[20, 21], "y"] = np.nan
    reading = read(frame, *COLUMNS, split_gaps=True)
    assert reading.said[-1] == "2 experiments of one file, cut at 2 rows with missing cells"


def test_both_options_together_cut_at_missing_cells_and_interpolate_between(log):
    reading = read(log({(20, "u"): ""}), *COLUMNS, split_gaps=True, resample=0.05)
    assert "cut at 1 row with missing cells" in str(reading)
    assert pieces(reading)[0] == pytest.approx(np.arange(0, 19.1, 0.5))


@pytest.mark.parametrize(
    ("every", "said"), [(1, "fill it in or end the record"), (3, "between its missing cells and gaps no piece has 10")]
)
def test_a_record_of_which_next_to_nothing_would_be_left_is_refused(log, refused, every, said):
    assert said in refused(log({(k, "u"): "" for k in range(0, N, every)}), *COLUMNS, split_gaps=True)


def test_in_a_folder_with_a_description_a_missing_cell_is_to_be_filled_in(good, refused):
    file = good / "train" / "000.csv"
    lines = file.read_text().splitlines()
    lines[5] = "0.4,,1"
    file.write_text("\n".join(lines))
    assert refused(good).endswith("the cell is empty; fill it in or end the record at the row before")
