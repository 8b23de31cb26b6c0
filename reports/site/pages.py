"""Pages from templates, and the files around them; whatever comes from a data set is text there."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from simgap.reports.diagnosis import numbers
from simgap.reports.rendering import LEFT, printable

HERE = Path(__file__).parent
WORDS = (*LEFT, "data set", "output", "unit", "hidden", "what")  # headings of columns of words
LONG = ("claim", "evidence")


class Writer:
    """Writes the files of a site below one folder; `folder` is new and empty."""

    def __init__(self, folder: Path, menu: list[tuple[str, str]]) -> None:
        self.folder = folder
        self.menu = menu  # of each page: its file and its name

    @cached_property
    def _environment(self) -> Environment:
        environment = Environment(
            loader=FileSystemLoader(HERE / "templates"), autoescape=True, undefined=StrictUndefined,
            finalize=_finalize, trim_blocks=True, lstrip_blocks=True,
        )  # fmt: skip
        environment.globals |= {"numbers": numbers, "is_words": lambda column: column in WORDS, "long": LONG}
        return environment

    def page(self, template: str, file: str, **content: Any) -> None:
        """Render a template into a file."""
        root = "../" * file.count("/")
        parent = f"{file.partition('/')[0]}.html" if root else ""
        about = {"file": file, "root": root, "parent": parent, "menu": self.menu}
        text = self._environment.get_template(template).render(content | about)
        self.text(file, text)

    def text(self, file: str, text: str) -> None:
        """Write a file."""
        path = self.folder / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def assets(self) -> None:
        """Copy what all pages share, plotly.js among it."""
        from plotly.offline import get_plotlyjs

        for asset in (HERE / "assets").iterdir():
            self.text(f"assets/{asset.name}", asset.read_text(encoding="utf-8"))
        self.text("assets/plotly.js", get_plotlyjs())


def unique(texts: Iterable[str]) -> list[str]:
    """List texts once each, in their order."""
    return list(dict.fromkeys(texts))


def _finalize(value: Any) -> Any:
    """Strip what is not printable from a string on its way into the page; markup stays."""
    return printable(value) if isinstance(value, str) and not hasattr(value, "__html__") else value
