"""A CSV file of a million rows and three columns, next to the strict reader alone, which takes one row at a time."""

from time import process_time

import numpy as np

from simgap.data import load
from simgap.data.formats.csv_files import read_csv
from simgap.data.formats.strict_csv import strict_table


def test_csv_next_to_the_strict_reader(compare, row, timed, tmp_path):
    file = tmp_path / "log.csv"
    table = np.column_stack([np.arange(1_000_000) / 100, np.random.default_rng(0).normal(size=(1_000_000, 2))])
    with file.open("w", encoding="utf-8") as stream:
        stream.write("t,u,y\n")
        stream.writelines(f"{t!r},{u!r},{y!r}\n" for t, u, y in table.tolist())

    def numbers(read):
        columns = read()
        return [columns.numbers(name) for name in columns.names]

    def strict():
        return timed(numbers, lambda: strict_table(file, file.read_bytes()))

    np.testing.assert_array_equal(np.column_stack(numbers(lambda: read_csv(file))), table)
    compare("CSV, 1e6 x 3", "row by row", lambda: numbers(lambda: read_csv(file)), strict, 3, limit=5)

    start = process_time()  # one thread, so that neighbours do not count
    load(file, ["u"], ["y"])
    seconds = process_time() - start
    row("load of that file with all checks, CPU time", seconds, "a second", 1.0, 1)
    assert seconds <= 1
