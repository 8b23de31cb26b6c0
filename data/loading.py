"""`load`: one way in for registered data sets, folders, files and DataFrames; `read` also says what it inferred."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeGuard

from simgap.data.formats.folder import load_folder
from simgap.data.formats.headings import find, listed
from simgap.data.formats.logs import ENDINGS, is_described, logs_of, not_read, record_of_logs
from simgap.data.formats.one_record import Choices, dataset_of
from simgap.data.formats.plant_table import with_known
from simgap.data.formats.tables import Table
from simgap.data.kinds import told, with_kinds
from simgap.data.named import is_registered, load_registered
from simgap.data.simulated_columns import split_off
from simgap.records import LONGEST_NAME, Channels, Dataset, Experiment, UnusableInput
from simgap.registry import DATASETS

Kinds = str | Mapping[str, str] | None


@dataclass(frozen=True, eq=False)
class Recordings:
    """Experiments for a model that is fitted already: of a data set those to test on, and beside them the others."""

    experiments: tuple[Experiment, ...]
    others: tuple[Experiment, ...]
    channels: Channels


@dataclass(frozen=True)
class Reading:
    """A data set, and in words what was inferred, cut or interpolated on the way to it.

    `simulated` is the same with the outputs of somebody's simulation, where columns of it were named.
    """

    dataset: Dataset
    said: tuple[str, ...] = ()
    simulated: Dataset | None = None

    def __str__(self) -> str:
        """Tell in one line what was inferred; empty where nothing was."""
        return f"read: {', '.join(self.said)}" if self.said else ""


def load(
    source: Any,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    name: str | None = None,
    kind: Kinds = None,
    resample: float | None = None,
    split_gaps: bool = False,
    known: Mapping[str, Any] | None = None,
) -> Dataset:
    """Load a data set: a registered name, a folder, a file of one record, a pandas DataFrame, or a list of files.

    A name may carry parameters where its data set takes some, "gimbal-noise4-delay0.2".
    A file (CSV, .mat or .parquet) and a DataFrame are one record: `inputs` and `outputs` name its columns, with or
    without the unit that stands there. The sampling time is that of the time column or `dt` in seconds, and the record
    is split in time 60/20/20. A folder without a dataset.toml holds such files with the same columns, one record in
    the order of their names; a list is one in its own order. `kind` says what the outputs are, {"speed": "velocity"},
    or the kind of a single output.
    `resample` interpolates onto an even grid of that many seconds, `split_gaps` starts a new experiment at each gap and
    after missing cells. A time column that is too coarse for `dt` is ignored.
    `known` is what a table [plant] of a dataset.toml says of the machine, {"mass": "0.5 kg"}.
    Raises UnusableInput when the data cannot be used, and its subclass Missing when they are not at hand.
    """
    return read(source, inputs, outputs, dt, name, kind, resample, split_gaps, known).dataset


def read(
    source: Any,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    name: str | None = None,
    kind: Kinds = None,
    resample: float | None = None,
    split_gaps: bool = False,
    known: Mapping[str, Any] | None = None,
    simulated: Sequence[str] = (),
) -> Reading:
    """Load a data set as `load` does, and say in words what was inferred, cut or interpolated.

    `simulated` names the columns that hold somebody's simulation of the outputs, in the order of these.
    """
    choices = Choices(inputs, outputs, dt, name, resample, split_gaps)
    described = _known(source, choices, simulated)
    if described is not None:
        dataset, said = described, ()
    else:
        choices = replace(
            choices, outputs=[*outputs, *simulated] if simulated and not isinstance(outputs, str) else outputs
        )
        record = record_of_logs(read_tables(source, choices), choices)
        dataset, said = dataset_of(record, name or _name_of(Path(record.source))), record.said
        if _is_folder(source):
            said = (*said, *not_read(Path(source)))
    theirs = None
    if simulated:
        dataset, theirs = split_off(dataset, simulated)
    dataset = with_known(with_kinds(dataset, kind), known)
    return Reading(dataset, (*told(dataset.channels), *said), theirs)


def _name_of(file: Path) -> str:
    """Name a data set after its file: "log (1).csv" becomes "log 1"."""
    return re.sub(r"[^\w.\-]+", " ", file.stem)[:LONGEST_NAME].strip(" ._-") or "record"


def read_recordings(
    source: Any, channels: Channels, dt: float | None = None, resample: float | None = None, split_gaps: bool = False
) -> Recordings:
    """Read what a model that was fitted on such channels can simulate; the other arguments are those of `load`.

    A file is one experiment, unsplit, of the columns that the channels name, and so is each file of a folder without a
    dataset.toml. Raises UnusableInput.
    """
    of_file = Choices(dt=dt, resample=resample, split_gaps=split_gaps)
    choices = replace(of_file, inputs=[c.name for c in channels.inputs], outputs=[c.name for c in channels.outputs])
    known = source if isinstance(source, Dataset) else _known(source, of_file)
    if known is not None:
        return Recordings(known.test, known.training.valid + known.training.train, known.channels)
    tables = read_tables(source, choices)
    for table in tables:
        for column in (*choices.inputs, *choices.outputs):
            if not find(table.names, column):
                raise UnusableInput(f"{table.source} has no column {column!r}, which the model was fitted on; "
                                    f"there are {listed(table.names)}")  # fmt: skip
    record = record_of_logs(tables, choices)
    return Recordings(record.pieces, (), record.channels)


def _known(source: Any, choices: Choices, simulated: Sequence[str] = ()) -> Dataset | None:
    """Load a source that describes itself; None for a file, a DataFrame and a folder of files alone."""
    if isinstance(source, str) and is_registered(source):
        _refuse_columns(choices, f"data set {source}")
        return load_registered(source)
    if not isinstance(source, str | os.PathLike):
        return None
    if is_described(Path(source)):
        _refuse_columns(choices, f"folder {Path(source)}")
        return load_folder(Path(source), simulated)
    return None


def _nowhere(source: str) -> str:
    """Say that there is no such source: of a path which files may be meant, of a bare name which data sets."""
    folder, name = os.path.split(source)
    if not folder and not name.lower().endswith(ENDINGS):
        return (
            f"there is no data set, folder or CSV file called {source!r}; known data sets are "
            f"{', '.join(DATASETS.names())}"
        )
    folder = folder or "."
    if not os.path.isdir(folder):  # noqa: PTH112
        return f"there is no file {source}, because there is no folder {folder}"
    with suppress(OSError):  # of a folder that may not be read
        alike = get_close_matches(name, os.listdir(folder), n=2)  # noqa: PTH208
        if alike:
            return f"there is no file {source}; is {' or '.join(alike)} meant?"
    return f"there is no file {source}, seen from the folder {Path.cwd()}"


def read_tables(source: Any, choices: Choices) -> list[Table]:
    """Read a DataFrame, a file, a list of files, or all logs of a folder. Raises UnusableInput."""
    if isinstance(source, list | tuple):
        return [read_table(log, choices) for log in _each_once(source)]
    if _is_folder(source):
        return [read_table(file, choices) for file in logs_of(Path(source))]
    return [read_table(source, choices)]


def _is_folder(source: Any) -> TypeGuard[str | os.PathLike[str]]:
    return isinstance(source, str | os.PathLike) and os.path.isdir(source)  # noqa: PTH112  # it never raises


def _each_once(logs: Sequence[Any]) -> Sequence[Any]:
    """Check that logs are paths of files, none of them twice. Raises UnusableInput."""
    if not logs or not all(isinstance(log, str | os.PathLike) for log in logs):
        raise UnusableInput("a data set cannot be made from this list; give the paths of log files")
    for log in logs:
        if not os.path.exists(log) and not is_registered(os.fspath(log)):  # noqa: PTH110  # it never raises
            raise UnusableInput(_nowhere(os.fspath(log)))
        if not os.path.isfile(log):  # noqa: PTH113
            raise UnusableInput(
                f"of several logs each must be a file; {log} is a folder or a data set, so name it alone"
            )
        if sum(os.path.samefile(log, other) for other in logs if os.path.exists(other)) > 1:  # noqa: PTH110, PTH121
            raise UnusableInput(f"{log} is named twice, and would be in training and test; name each log once")
    return logs


def read_table(source: Any, choices: Choices) -> Table:
    """Read a DataFrame, or a file by its ending; any other ending is CSV. Raises UnusableInput."""
    if not isinstance(source, str | os.PathLike):
        from simgap.data.formats.frames import table_of  # pandas is slow to import

        return table_of(source)
    path = Path(source)
    if not os.path.exists(source):  # noqa: PTH110
        raise UnusableInput(_nowhere(os.fspath(source)))
    if not path.is_file():  # a pipe would never end
        raise UnusableInput(f"{path} is no ordinary file; give a CSV file")
    match path.suffix.lower():
        case ".mat":
            from simgap.data.formats.mat_files import read_mat

            return read_mat(path, (*choices.inputs, *choices.outputs))
        case ".parquet":
            from simgap.data.formats.parquet_files import read_parquet

            return read_parquet(path)
        case _:
            from simgap.data.formats.csv_files import read_csv

            return read_csv(path)


def _refuse_columns(choices: Choices, source: str) -> None:
    if any((choices.inputs, choices.outputs, choices.resample, choices.split_gaps)) or (
        choices.dt is not None or choices.name is not None
    ):
        raise UnusableInput(f"{source} knows its columns, sampling time and name; leave those arguments out")
