"""A pandas DataFrame as a table: rows are counted from 0, as in `frame.iloc`."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from simgap.data.formats.tables import BadCell, Table
from simgap.records import UnusableInput


def table_of(frame: Any, source: str = "DataFrame") -> Table:
    """Make a table of a DataFrame's columns, and of its index if that has a name.

    Raises UnusableInput for anything but a DataFrame with rows.
    """
    if not isinstance(frame, pd.DataFrame):
        raise UnusableInput(
            f"a data set cannot be made from {type(frame).__name__}; "
            f"give a registered name, a folder, a CSV file or a DataFrame"
        )
    if frame.empty:
        raise UnusableInput(f"{source}: it has no rows or no columns; give it one row per sample")
    if frame.index.nlevels == 1 and frame.index.name is not None and frame.index.name not in frame.columns:
        frame = frame.reset_index()
    columns = tuple(frame.iloc[:, i] for i in range(frame.shape[1]))
    return Table(source, tuple(map(str, frame.columns)), columns, first_row=0, parse=_parse)


def _parse(column: pd.Series) -> Float[np.ndarray, " T"]:
    if not pd.api.types.is_numeric_dtype(column.dtype) or column.dtype.kind in "cb":
        for index, value in enumerate(column):
            if not isinstance(value, Real) or isinstance(value, bool | np.bool_):
                why = f"a {type(value).__name__} is not a real number; convert the column with astype(float)"
                raise BadCell(index, why)
    try:
        # a copy, so that changing the frame later does not change the record
        return np.array(column.to_numpy(dtype=np.float64, na_value=np.nan))
    except OverflowError:
        raise BadCell(0, "the column holds a whole number beyond float64; correct it") from None
