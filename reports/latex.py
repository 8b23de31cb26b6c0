"""Tables as LaTeX with booktabs. Names from data sets are shown, never interpreted."""

from __future__ import annotations

from simgap.reports.rendering import LEFT, printable
from simgap.reports.tables import Cell, Table

SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "²": r"\textsuperscript{2}",
}  # fmt: skip


def to_latex(table: Table) -> str:
    """Write a table environment, the best of a column bold, the second best underlined, notes below."""
    sides = "".join("l" if column in LEFT else "r" for column in table.columns)
    lines = [
        r"% needs \usepackage{booktabs}", r"\begin{table}", r"\centering", rf"\caption{{{escape(table.title)}}}",
        rf"\begin{{tabular}}{{{sides}}}", r"\toprule",
        " & ".join(escape(column) for column in table.columns) + r" \\", r"\midrule",
        *(" & ".join(map(_marked, row)) + r" \\" for row in table.rows), r"\bottomrule", r"\end{tabular}",
    ]  # fmt: skip
    lines += [rf"\par\smallskip\footnotesize [{i}] {escape(note)}" for i, note in enumerate(table.notes, start=1)]
    return "\n".join([*lines, r"\end{table}", ""])


def escape(text: str) -> str:
    """Escape a text so that LaTeX shows it as it is, on one line."""
    return "".join(SPECIAL.get(character, character) for character in printable(text))


def _marked(cell: Cell) -> str:
    text = escape(cell.text)
    # A bracket after the \\ of the row before would be read as its argument.
    text = f"{{{text}}}" if text.startswith("[") else text
    return rf"\textbf{{{text}}}" if cell.best else rf"\underline{{{text}}}" if cell.second else text
