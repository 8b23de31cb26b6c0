"""Which data sets are at hand, and how to get those that are not."""

from __future__ import annotations

import contextlib
import inspect
import shutil
import sys
import tempfile
from pathlib import Path

from simgap.data.measured.locations import Source, cache, one_line
from simgap.records import UnusableInput
from simgap.registry import DATASETS


def available() -> dict[str, str]:
    """Map every registered data set to "" when it is at hand, else to one sentence why not and how to get it.

    Looks only at whether files exist; reads none.
    """
    return {name: _why_missing(name) for name in DATASETS.names()}


def card(name: str) -> str:
    """Give the card of a registered data set: its title, then machine, channels, source, licence."""
    return inspect.getdoc(DATASETS[name]) or name


def fetch(name: str) -> Path:
    """Download the files of a registered data set into the user's cache unless they are at hand.

    Returns the folder that holds them. Raises UnusableInput when the download fails, and then leaves nothing.
    """
    source = _source(name)
    if source is None:
        raise UnusableInput(f"{name} needs no download; load it, or write it to files with `simgap data make`")
    found = source.folder()
    if found is not None:
        return found
    if source.download is None:
        raise UnusableInput(source.why_missing())
    folder = cache() / source.collection
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # the package reports on standard output, which belongs to our caller
        quiet = contextlib.redirect_stdout(sys.stderr)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".fetch_") as fresh, quiet:
            source.download(Path(fresh))
            if not source.complete(Path(fresh)):
                raise UnusableInput(f"the download lacks files of {', '.join(source.patterns)}")
            source.build(Path(fresh))
            _move_into(Path(fresh), folder)
    except Exception as error:  # a download fails in any way, and all of them mean the same
        for empty in (folder, folder.parent):
            with contextlib.suppress(OSError):
                empty.rmdir()
        raise UnusableInput(
            f"{name} could not be downloaded ({one_line(error)}); try again later, "
            f"or get it by hand from {source.where} and put {', '.join(source.patterns)} into {folder}"
        ) from error
    return folder


def _source(name: str) -> Source | None:
    return getattr(DATASETS[name], "source", None)


def _why_missing(name: str) -> str:
    try:
        source = _source(name)
    except UnusableInput as error:
        return str(error)
    return source.why_missing() if source is not None else ""


def _move_into(fresh: Path, folder: Path) -> None:
    for entry in fresh.iterdir():
        target = folder / entry.name
        if target.is_dir():
            shutil.rmtree(target)  # the remains of a broken set, or it would have been found
        entry.replace(target)
