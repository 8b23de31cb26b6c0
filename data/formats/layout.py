"""How a CSV file is laid out: comments, separator, decimal mark, a line of units; seen from its first lines."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

from simgap.units import quantity

LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n|\Z)")
SEPARATORS = "\t;,"
NUMBER = re.compile(r"\s*[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?\s*")
DECIMAL = r'(?:^|[{0}\r\n])[ "]*[-+]?\d*([.,])\d*(?:[eE][-+]?\d+)?[ "]*(?=[{0}\r\n]|\Z)'
MARK_BEFORE_EXCEL = re.compile(r'"?sep=([,;\t])"?')


@dataclass(frozen=True)
class Layout:
    """The layout of a file; `skipped` lines stand before the header, which may be a comment itself."""

    skipped: int = 0
    separator: str = ","
    decimal: str = "."
    units: tuple[str, ...] = ()
    header_is_comment: bool = False

    @property
    def first_row(self) -> int:
        """Line of the first sample; the first line of the file is 1."""
        return self.skipped + 2 + bool(self.units)


def layout_of(text: str) -> Layout:
    """See how a file is laid out.

    Lines of # before the header are comments; the last of them is the header where numbers follow it. A second line
    without numbers is one of units when every cell is a unit. Commas are decimal only between semicolons or tabs.
    """
    skipped, at, separator, comment = 0, 0, "", None
    while line := LINE.match(text, at):
        content = line[0].strip()
        mark = None if skipped else MARK_BEFORE_EXCEL.fullmatch(content)
        if mark:
            separator = mark[1]
        elif content.startswith("#"):
            comment = (skipped, at, content.lstrip("# "))
        elif content or comment is None:
            break
        skipped, at = skipped + 1, line.end()
        if at >= len(text):
            break
    header, is_comment = _line(text, at), False
    if comment and comment[0] == skipped - 1 and _is_comment_header(comment[2], header):
        (skipped, at, header), is_comment = comment, True
    following = LINE.match(text, at).end()  # type: ignore[union-attr]  # it matches anywhere
    second = _line(text, following)
    separator = separator or _separator(header, second)
    units = _units(_cells(second, separator), len(_cells(header, separator)))
    decimal = _decimal(text, following, separator) if separator != "," else "."
    return Layout(skipped, separator, decimal, units, is_comment)


def _line(text: str, at: int) -> str:
    return LINE.match(text, at)[0].strip("\r\n")  # type: ignore[index]  # it matches anywhere


def _cells(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True), [])
    except csv.Error:
        return []


def _is_comment_header(comment: str, numbers: str) -> bool:
    separator = _separator(comment, numbers)
    names, cells = _cells(comment, separator), _cells(numbers, separator)
    return len(names) == len(cells) > 1 and any(map(NUMBER.fullmatch, cells))


def _separator(header: str, second: str) -> str:
    """Take the mark of the header that parts the second line into as many cells; else the first that is there."""
    bare = re.sub(r'"[^"]*"', "", header)
    found = [mark for mark in SEPARATORS if mark in bare]
    if len(found) > 1:
        found = [mark for mark in found if len(_cells(header, mark)) == len(_cells(second, mark))] or found
    return found[0] if found else ","


def _units(cells: list[str], columns: int) -> tuple[str, ...]:
    """Read a line of units, in brackets or bare; give none where one of its cells is anything else."""
    units = tuple(re.sub(r"^[\[(](.*)[\])]$", r"\1", cell.strip()).strip() for cell in cells)
    known = [quantity(unit) for unit in units if unit]
    sure = all(known) and any(one and not one.label for one in known)
    numbers = sum(map(bool, map(NUMBER.fullmatch, units)))  # a 1 may say that a column has no unit
    return units if len(units) == columns and sure and 2 * numbers < len(known) else ()


def _decimal(text: str, start: int, separator: str) -> str:
    """Take the mark in the first number of the file that has one."""
    if text.find(",", start) < 0:
        return "."
    found = re.compile(DECIMAL.format(re.escape(separator))).search(text, start)
    return found[1] if found else "."
