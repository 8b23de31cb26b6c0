"""A Parquet file as a table: rows are counted from 0."""

from __future__ import annotations

from pathlib import Path

from simgap.data.formats.frames import table_of
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput


def read_parquet(path: Path) -> Table:
    """Read a Parquet file. Raises UnusableInput for a broken one, and where pyarrow is not installed."""
    import pandas as pd

    try:
        import pyarrow  # noqa: F401  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise UnusableInput(
            f"{path}: Parquet needs pyarrow, which is not installed; `pip install pyarrow`, or save the file as CSV"
        ) from None
    try:
        frame = pd.read_parquet(path, engine="pyarrow")
    except Exception as error:  # pyarrow raises what it likes at a broken file
        why = " ".join(str(error).split())[:200]
        raise UnusableInput(f"{path} cannot be read as Parquet ({why}); write it anew or save it as CSV") from None
    return table_of(frame, str(path))
