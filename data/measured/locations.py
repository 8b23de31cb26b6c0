"""Where the files of measured data sets are looked for, and the decorator that ties a loader to its files."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import platformdirs

from simgap.records import Dataset, UnusableInput


class Missing(UnusableInput):
    """A registered data set whose files are not at hand; the message names the command that gets them."""


@dataclass(frozen=True)
class Source:
    """The files that a measured data set is read from.

    `patterns` are globs below the folder of the collection; each must match a file. `download(folder)` puts
    the files into an empty folder; there is none where the owners state no licence. `where` tells people where to find
    them by hand.
    """

    name: str
    collection: str
    patterns: tuple[str, ...]
    download: Callable[[Path], None] | None
    where: str
    build: Callable[[Path], Dataset]

    def folder(self) -> Path | None:
        """Find the first folder that holds all files; None without one."""
        for root in roots():
            for folder in (root / self.collection, root):
                if self.complete(folder):
                    return folder
        return None

    def complete(self, folder: Path) -> bool:
        """Tell whether each pattern matches a file below the folder."""
        return all(any(file.is_file() for file in folder.glob(pattern)) for pattern in self.patterns)

    def why_missing(self) -> str:
        """Say how to get the files in one sentence; empty when they are at hand."""
        if self.folder() is not None:
            return ""
        if self.download is None:
            return (f"{self.name} is not at hand; its owners state no licence, so clone {self.where} yourself and set "
                    f"SIMGAP_DATA to the clone")  # fmt: skip
        return f"{self.name} is not at hand; get it with `simgap data fetch {self.name}`"

    def read(self, folder: Path) -> Dataset:
        """Read the data set in the files of `folder`. Raises UnusableInput when they are broken."""
        try:
            return self.build(folder)
        except UnusableInput:
            raise
        except ImportError as error:
            raise UnusableInput(
                f"{self.name} cannot be read: a package is missing ({one_line(error)}); install it with pip"
            ) from error
        except Exception as error:  # scipy's reader fails in any way on a broken .mat file
            raise UnusableInput(
                f"{self.name}: the files in {folder} cannot be read ({one_line(error)}); "
                f"delete them and run `simgap data fetch {self.name}`"
            ) from error


def reads(
    collection: str, *patterns: str, download: Callable[[Path], None] | None, where: str
) -> Callable[[Callable[[Path], Dataset]], Callable[..., Dataset]]:
    """Turn `name(folder) -> Dataset` into `name(n_init=0) -> Dataset`, which finds its folder or raises Missing.

    n_init is the number of measured samples that start a simulation, 0 for what the set itself says. The result carries
    the Source as `.source` and keeps name and docstring. It never downloads.
    """

    def tie(build: Callable[[Path], Dataset]) -> Callable[..., Dataset]:
        source = Source(build.__name__, collection, patterns, download, where, build)

        def load_files(n_init: int = 0) -> Dataset:
            folder = source.folder()
            if folder is None:
                raise Missing(source.why_missing())
            dataset = source.read(folder)
            return _started(dataset, n_init) if n_init else dataset

        for name in ("__module__", "__name__", "__qualname__", "__doc__"):  # the signature stays that of load_files
            setattr(load_files, name, getattr(build, name))
        load_files.source = source  # type: ignore[attr-defined]
        return load_files

    return tie


def _started(dataset: Dataset, n_init: int) -> Dataset:
    training = replace(dataset.training, n_init=n_init)
    return replace(dataset, training=training, n_init=n_init, sha256="")  # a digest of its own


def roots() -> list[Path]:
    """List the folders that may hold measured data, in the order in which they are searched."""
    checkout = Path(__file__).resolve().parents[2]
    shared = [Path.cwd().parent / "shared" / "data", checkout.parent / "shared" / "data"]
    own = [Path(os.environ["SIMGAP_DATA"])] if os.environ.get("SIMGAP_DATA") else []
    return [*own, *(folder for folder in shared if folder.is_dir()), cache()]


def cache() -> Path:
    """Find the user's cache folder, where `simgap data fetch` puts files."""
    return Path(platformdirs.user_cache_dir("simgap"))


def one_line(error: BaseException) -> str:
    """Put the text of an error on one line, or the name of its type when it has none."""
    return " ".join(str(error).split()) or type(error).__name__
