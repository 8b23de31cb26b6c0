"""Diagnoses found in a folder of results: what `simgap diagnose --html` and `--json` wrote."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import unescape
from pathlib import Path
from typing import Any

from simgap.findings import Value
from simgap.results.artefacts import FOLDER

MARK = ".simgap-site"  # of a folder that holds a site, which may be written anew
LARGEST = 64 << 20  # bytes of a file that is looked at
TITLE = re.compile(r"<title>Diagnosis of (.*?)</title>", re.DOTALL)
HEADLINE = re.compile(r"<h1>(.*?)</h1>", re.DOTALL)
PLOTLY = re.compile(r"<script>(.*?)</script>\s*(?=</head>)", re.DOTALL)
INLINE_ONLY = "script-src 'unsafe-inline'"
BACK = '<p style="padding: 8px clamp(14px, 3vw, 32px); margin: 0"><a href="../diagnoses.html">All diagnoses</a></p>'


@dataclass(frozen=True, eq=False)
class Found:
    """One diagnosis: the page that `--html` wrote, what `--json` wrote, or both."""

    source: str  # its file, from the folder of results on
    dataset: str
    headline: str
    page: str = ""
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The file without its ending, and without a folder of diagnoses."""
        return self.source.rpartition(".")[0].removeprefix("diagnoses/")

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        return str(self.facts.get("verdict", "")).replace("_", " ")

    def values(self, cause: dict[str, Any]) -> list[Value]:
        """The estimates of a cause, without those that the file leaves open."""
        known = [p for p in cause.get("parameters", ()) if None not in p.values()]
        return [Value(p["name"], p["unit"], p["value"], p["low"], p["high"]) for p in known]


def find(folder: Path) -> list[Found]:
    """Find all diagnoses below a folder, sites left out; a page and a JSON file of one name belong together."""
    pages = {path.with_suffix(""): path for path in _files(folder, ".html")}
    facts = {path.with_suffix(""): path for path in _files(folder, ".json")}
    found = []
    for stem in sorted({*pages, *facts}):
        page = pages[stem].read_text("utf-8", "replace") if stem in pages else ""
        title = TITLE.search(page[:20_000])
        known = _facts(facts[stem]) if stem in facts else {}
        if not (title or known):
            continue
        source = str((pages[stem] if title else facts[stem]).relative_to(folder))
        headline = HEADLINE.search(page) if title else None
        name = str(known.get("dataset") or unescape(title[1] if title else ""))
        text = unescape(headline[1]) if headline else _headline(known)
        found.append(Found(source, name, text, page if title else "", known))
    return found


def share_plotly(page: str) -> tuple[str, str, str]:
    """Take the copy of plotly.js out of a page: the page, which loads it from ../assets, its file name, its text.

    Pages of one version of plotly share one file: that of the site where it is the same. A page without plots has no
    copy.
    """
    from plotly.offline import get_plotlyjs

    page = page.replace("<body>", f"<body>\n{BACK}", 1)
    match = PLOTLY.search(page)
    if match is None:
        return page, "", ""
    same = match[1].strip() == get_plotlyjs().strip()
    name = "plotly.js" if same else f"plotly-{hashlib.sha256(match[1].encode()).hexdigest()[:12]}.js"
    head, tail = page[: match.start()], page[match.end() :]
    head = head.replace(INLINE_ONLY, "script-src 'self' file: 'unsafe-inline'", 1)
    loader = f'<script src="../assets/later.js" data-plotly="../assets/{name}"></script>\n'
    return head + loader + tail, name, match[1]


def _files(folder: Path, ending: str) -> Iterator[Path]:
    sites = {mark.parent for mark in folder.rglob(MARK)}
    for path in sorted(folder.rglob(f"*{ending}")):
        inside = path.relative_to(folder).parts
        if sites & {*path.parents} or inside[0] == FOLDER or any(part.startswith(".") for part in inside):
            continue
        if path.is_file() and path.stat().st_size <= LARGEST:
            yield path


def _facts(path: Path) -> dict[str, Any]:
    """Read what `--json` wrote; empty for any other file."""
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return {}
    fields = {"dataset": str, "verdict": str, "baseline": dict, "causes": list, "gain": dict, "wrong": list}
    if not (isinstance(known, dict) and known.get("schema") == 1):
        return {}
    return known if all(isinstance(known.get(name), kind) for name, kind in fields.items()) else {}


def _headline(known: dict[str, Any]) -> str:
    titles = [str(cause.get("title", "")) for cause in known["causes"]]
    share = known["gain"].get("share")
    if titles:
        gain = f"; with {'it' if len(titles) == 1 else 'them'} the free-run error on the test experiments falls by "
        return f"Named: {', '.join(titles)}" + (f"{gain}{100 * share:.0f} %" if share is not None else "")
    return f"Verdict: {known['verdict'].replace('_', ' ')}"
