"""Each way in which a CSV file can be wrong is refused with the file, the row and the column."""

import os

import numpy as np
import pytest

from simgap.data import load

HEADER = "t,u,phi\n"
ROWS = [f"{k / 10},{k % 3},{k % 5}\n" for k in range(20)]


def with_row(number: int, text: str) -> str:
    """The good file with the line of that number (the header is line 1) replaced."""
    lines = [HEADER, *ROWS]
    lines[number - 1] = text
    return "".join(lines)


def test_the_unbroken_file_loads(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text(HEADER + "".join(ROWS))
    data = load(file, ["u"], ["phi"])
    assert data.training.dt == 0.1
    assert np.array_equal(data.training.train[0].y[:, 0], [k % 5 for k in range(12)])


@pytest.mark.parametrize("cell", ["", "  ", "nan", "NaN", "NA", "inf", "-Infinity", "1e999", "1e101", "-1e200"])
def test_a_cell_that_is_no_measurement_is_named(refused_cell, cell):
    refused_cell(with_row(7, f"0.5,{cell},1\n"), row=7, column="u")


@pytest.mark.parametrize("cell", ["abc", "1_000", "0x10", "1,5".replace(",", "·"), "١٢", "1 2", "--1", "1e", "True"])
def test_text_in_a_number_column_is_named(refused_cell, cell):
    assert "not a number" in refused_cell(with_row(7, f"0.5,1,{cell}\n"), row=7, column="phi")


def test_a_very_long_cell_is_quoted_in_part(refused_cell):
    assert len(refused_cell(with_row(7, f"0.5,1,{'x' * 5000}\n"), row=7, column="phi")) < 300


def test_a_missing_column_is_named_with_those_that_are_there(refused_cell):
    assert "'t', 'v', 'phi'" in refused_cell(with_row(1, "t,v,phi\n"), row=1, column="u")


def test_a_doubled_column_is_named(refused_cell):
    assert "2 times" in refused_cell("t,u,u,phi\n0,1,2,3\n0.1,2,3,4\n", row=1, column="u")


def test_a_doubled_column_that_nobody_uses_is_no_matter(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("x,x," + HEADER + "".join("a,b," + row for row in ROWS))
    assert load(file, ["u"], ["phi"]).channels.inputs[0].name == "u"


def test_a_file_without_a_header_is_refused_by_its_first_line(refused_cell):
    assert "put a line of names above" in refused_cell("".join(ROWS), row=1, column=None)


@pytest.mark.parametrize("above", ["Project: servo\n", "Project,,\nby hand\n", "# cart\nProject: servo, 3rd\n"])
def test_lines_above_the_names_of_the_columns_are_named_with_what_to_do(refused_cell, above):
    row = 2 if above.startswith("#") else 1
    assert "begin each line above the names with #" in refused_cell(above + HEADER + "".join(ROWS), row, None)


def test_a_row_that_ends_early_is_named_with_the_column_it_lacks(refused_cell):
    refused_cell(with_row(9, "0.7,1\n"), row=9, column="phi")


def test_a_row_that_is_too_long_is_named_with_the_last_column(refused_cell):
    refused_cell(with_row(9, "0.7,1,2,3\n"), row=9, column="phi")


def test_a_row_cut_off_at_the_end_of_the_file_is_named(refused_cell):
    refused_cell(HEADER + "".join(ROWS) + "2.0", row=22, column="u")


def test_an_empty_row_between_samples_is_named(refused_cell):
    assert "empty" in refused_cell(with_row(9, "\n"), row=9, column=None)


def test_empty_lines_at_the_end_are_no_samples(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text(HEADER + "".join(ROWS) + "\n\n")
    data = load(file, ["u"], ["phi"])
    assert sum(map(len, (*data.training.train, *data.training.valid, *data.test))) == 20


@pytest.mark.parametrize(
    ("time", "said"), [("0.5", "stands still"), ("0.2", "goes back"), ("0.75", "a step of 0.1 s is due")]
)
def test_time_that_jumps_or_repeats_is_named(refused_cell, time, said):
    assert said in refused_cell(with_row(8, f"{time},1,2\n"), row=8, column="t")


def test_time_that_jumps_is_refused_against_a_given_sampling_time_too(refused_cell):
    refused_cell(with_row(8, "0.75,1,2\n"), row=8, column="t", dt=0.1)


def test_time_that_drifts_more_than_1_percent_from_the_sampling_time_is_refused(refused_cell):
    assert "advances 0.1 s a row" in refused_cell(HEADER + "".join(ROWS), row=21, column="t", dt=0.102)


def test_time_that_is_rounded_within_10_percent_of_a_step_passes(tmp_path):
    file = tmp_path / "log.csv"
    rows = [f"{round(k / 10 + 0.004 * (-1) ** k, 3)},{k % 3},{k % 5}\n" for k in range(20)]
    file.write_text(HEADER + "".join(rows))
    assert load(file, ["u"], ["phi"], dt=0.1).training.dt == 0.1


def test_the_sampling_time_is_the_mean_step_when_only_the_time_column_tells(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("time,u,phi\n" + "".join(f"{k / 30:.4f},{k % 3},{k % 5}\n" for k in range(1000)))
    assert load(file, ["u"], ["phi"]).training.dt == pytest.approx(1 / 30, rel=1e-5)


def test_an_input_that_never_moves_in_training_is_named(refused_cell):
    rows = [f"{k / 10},{3 if k < 12 else k},{k % 5}\n" for k in range(20)]
    assert "3.0 in all 12 rows" in refused_cell(HEADER + "".join(rows), row=None, column="u")


@pytest.mark.parametrize("mark", ["|", " "])
def test_a_file_with_other_marks_between_cells_is_told_which_to_take(refused_cell, mark):
    said = refused_cell((HEADER + "".join(ROWS)).replace(",", mark), row=1, column=None)
    assert "has a single cell; begin lines above the names of the columns with #, or separate the cells with" in said


@pytest.mark.parametrize("content", ["", "\n\n", "  \n", "\ufeff"])
def test_an_empty_file_is_refused(refused_cell, content):
    assert "is empty" in refused_cell(content, row=None, column=None)


def test_a_file_that_starts_with_an_empty_line_is_refused(refused_cell):
    refused_cell("\n" + HEADER + "".join(ROWS), row=1, column=None)


def test_a_file_with_only_a_header_is_refused(refused_cell):
    assert "nothing follows row 1" in refused_cell(HEADER, row=None, column=None)


def test_a_file_with_too_few_rows_for_three_splits_is_refused(refused_cell):
    said = refused_cell(HEADER + "".join(ROWS[:3]), row=None, column=None)
    assert "train has 1 row, no more than the 1 (n_init) that start a simulation; record more samples" in said


def test_wrong_encoding_is_named_by_its_row(refused_cell):
    content = with_row(5, "0.3,1,2 µ\n").encode("latin-1")
    assert "UTF-8" in refused_cell(content, row=5, column=None)


def test_utf_16_is_refused(refused_cell):
    assert "UTF-8" in refused_cell((HEADER + "".join(ROWS)).encode("utf-16"), row=1, column=None)


def test_a_nul_byte_is_named_by_its_row(refused_cell):
    assert "NUL" in refused_cell(with_row(5, "0.3,1,\0\n"), row=5, column=None)


def test_binary_content_is_refused(refused_cell):
    refused_cell(bytes(range(256)) * 10, row=None, column=None)


def test_a_cell_over_two_lines_is_named_by_its_row(refused_cell):
    refused_cell(with_row(5, '0.3,1,"2\n"\n'), row=5, column=None)


def test_an_open_quote_is_named_by_its_row(refused_cell):
    refused_cell(with_row(5, '0.3,1,"2\n'), row=5, column=None)


def test_text_after_a_closing_quote_is_named_by_its_row(refused_cell):
    assert "text after a closing quote" in refused_cell(with_row(5, '0.3,"1"2,1\n'), row=5, column=None)


def test_blanks_around_quoted_cells_are_fine(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text(HEADER + "".join(ROWS))
    plain = load(file, ["u"], ["phi"])
    cells = [", ".join(f'"{cell}" ' for cell in row.strip().split(",")) for row in (HEADER, *ROWS)]
    file.write_text("\n".join(cells))
    assert load(file, ["u"], ["phi"]).sha256 == plain.sha256


def test_a_cell_beyond_the_limit_of_the_csv_module_is_named_by_its_row(refused_cell):
    refused_cell(with_row(5, f"0.3,1,{'1' * 200_000}\n"), row=5, column=None)


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_rows_are_counted_as_an_editor_counts_lines(refused_cell, ending):
    refused_cell(with_row(7, "0.5,abc,1\n").replace("\n", ending), row=7, column="u")


def test_a_byte_order_mark_and_blanks_around_cells_are_fine(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("\ufeff" + (HEADER + "".join(ROWS)).replace(",", " , "), encoding="utf-8")
    assert load(file, ["u"], ["phi"]).channels.outputs[0].name == "phi"


def test_a_pipe_is_refused_before_anything_reads_from_it(refused, tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    assert "no ordinary file" in refused(tmp_path / "pipe.csv", ["u"], ["phi"])


def test_an_unreadable_file_is_refused(refused, tmp_path, monkeypatch):
    file = tmp_path / "log.csv"
    file.write_text(HEADER)

    def denied(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.read_bytes", denied)  # the tests may run as root, who may read all
    assert "Permission denied" in refused(file, ["u"], ["phi"])
