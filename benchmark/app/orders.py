"""What passes between the page, the server and the process that reads a record or diagnoses it; all of it is JSON."""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

Role = Literal["", "input", "output", "simulated"]


class Settings(Struct, frozen=True, forbid_unknown_fields=True):
    """What a person says of a record: columns by heading, units and kinds of them, times in s, [plant] as NAME=VALUE.

    `simulated` are columns of somebody's own simulation, one for each output.
    """

    inputs: list[str] = []
    outputs: list[str] = []
    simulated: list[str] = []
    units: dict[str, str] = {}
    kinds: dict[str, str] = {}
    dt: float | None = None
    resample: float | None = None
    split_gaps: bool = False
    known: list[str] = []


class Order(Struct, frozen=True, forbid_unknown_fields=True):
    """What a worker is to do with a data set, a folder or a file; it writes what lasts into the folder `out`."""

    do: Literal["look", "diagnose"]
    source: str
    settings: Settings = Settings()
    out: str = ""


class Column(Struct, frozen=True):
    """A column of a record; `problem` says why it cannot be used, `role` and `kind` what its heading suggests."""

    heading: str
    name: str
    unit: str = ""
    role: Role = ""
    kind: str = ""
    low: float = 0.0
    high: float = 0.0
    problem: str = ""


class Curve(Struct, frozen=True):
    """A column to be drawn: values y over x, thinned where there are many."""

    heading: str
    x: list[float]
    y: list[float]


class Look(Struct, frozen=True):
    """What a record holds. `fixed` where a dataset.toml says which columns are inputs and outputs.

    `dt` is the sampling time in s, None where it is not known; `uneven` says why the column of time gives none.
    """

    samples: int
    columns: list[Column]
    curves: list[Curve]
    x_title: str
    fixed: bool = False
    time: str = ""
    dt: float | None = None
    uneven: str = ""
    about: str = ""


class Report(Struct, frozen=True, omit_defaults=True):
    """A line that a worker writes: a stage that begins, a refusal in one sentence, or, at the end, what it found."""

    stage: str = ""
    refused: str = ""
    look: Look | None = None
    headline: str = ""
