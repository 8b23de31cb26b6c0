"""Tables for the terminal and as Markdown. Names from data sets are shown, never interpreted."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from simgap.reports.tables import Cell, Table

if TYPE_CHECKING:
    import rich.console

# Columns of words.
LEFT = ("model", "data set", "best classical", "best network", "winner", "tool", "figure", "hidden", "status", "claim",
        "section", "judgement", "verdict", "evidence", "the paper's figures", "chosen", "RMSE on the test",
        "best on the test")  # fmt: skip
WIDEST_WORD = 18  # of a heading on a terminal, where longer ones are broken
WIDEST_TEXT = 24  # of a column of words on a narrow terminal; a wide one gives half of what numbers leave


def to_rich(table: Table, width: int = 120) -> rich.console.Group:
    """Draw a table for a terminal `width` characters wide, its footnotes below.

    The best of a column is bold, the second best underlined.
    Words wrap, numbers never: the last columns are left out, and named, where the width does not suffice.
    """
    from rich import box
    from rich.console import Group
    from rich.table import Table as RichTable
    from rich.text import Text

    widths = [_width(table, i, width) for i in range(len(table.columns))]
    shown = max((n for n in range(len(widths) + 1) if sum(widths[:n]) + 2 * n < width), default=0)
    drawn = RichTable(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for column, column_width in zip(table.columns[:shown], widths, strict=False):
        heading = Text(printable(column), overflow="fold")
        drawn.add_column(heading, justify="left" if column in LEFT else "right", width=column_width)
    for row in table.rows:
        # Appended, because the style of a whole Text would underline the blanks beside a number.
        drawn.add_row(*(Text().append(printable(c.text), style=_style(c)) for c in row[:shown]))
    notes = _numbered(table)
    if shown < len(widths):
        notes.append(f"Not shown on this narrow terminal: {printable(', '.join(table.columns[shown:]))}")
    return Group(Text(printable(table.title), style="bold"), drawn, *map(Text, notes), Text())


def _width(table: Table, column: int, width: int) -> int:
    """Count the characters of a column: those of its longest entry or of its heading's longest word; words may wrap."""
    word = max(map(len, table.columns[column].split()), default=0)
    entry = max((len(row[column].text) for row in table.rows), default=0)
    if table.columns[column] in LEFT:
        entry = min(entry, max(WIDEST_TEXT, (width - 52) // 2))
    return max(min(word, WIDEST_WORD), entry, 1)


def _style(cell: Cell) -> str:
    if cell.best:
        return "bold"
    return "underline" if cell.second else ""


def to_markdown(table: Table, level: int = 2) -> str:
    """Write a table as Markdown under a heading of that level, the best of a column bold, the second best italic."""
    lines = [f"{'#' * level} {escape(table.title)}", ""]
    lines.append("| " + " | ".join(escape(column) for column in table.columns) + " |")
    lines.append("|" + "".join("---|" if column in LEFT else "--:|" for column in table.columns))
    for row in table.rows:
        lines.append("| " + " | ".join(map(_marked, row)) + " |")
    for note in _numbered(table):
        lines += ["", escape(note)]
    return "\n".join(lines) + "\n"


def _marked(cell: Cell) -> str:
    mark = "**" if cell.best else "*" if cell.second else ""
    return mark + escape(cell.text) + mark


def escape(text: str) -> str:
    """Escape a text so that Markdown and HTML show it as it is, on one line."""
    text = printable(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_{}\[\]|#~$!])", r"\\\1", text)


def printable(text: str) -> str:
    """Replace line breaks and what a terminal would obey by blanks."""
    return "".join(c if c.isprintable() else " " for c in text)


def _numbered(table: Table) -> list[str]:
    return [f"[{number}] {printable(note)}" for number, note in enumerate(table.notes, start=1)]
