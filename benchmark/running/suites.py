"""Suites: which models run on which data sets, for which tasks, how often and for how long at most."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simgap.records import UnusableInput
from simgap.registry import DATASETS, MODELS, Registry, file_of
from simgap.tasks import TASKS, USUAL

FOLDER = Path(__file__).parent / "suites"
STUDY = "recovery"  # what `simgap run` takes beside the suites: it has rigs and effects, no models
STUDY_TITLE = "How often a diagnosis names the effects that are hidden in simulated rigs"
KEYS = (
    "title", "datasets", "without", "models", "without_models", "groups", "tasks", "seeds", "timeout", "memory",
)  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """One model of a suite: a registered name or `file.py:Class`, its parameters, its name in the results.

    gpus: how many GPUs, or what part of one, a cluster sets apart for it.
    """

    name: str
    params: dict[str, Any] = field(default_factory=dict)
    label: str = ""
    gpus: float = 0.0

    def __post_init__(self) -> None:
        if not self.label:
            object.__setattr__(self, "label", self.name.rpartition(":")[2])


@dataclass(frozen=True)
class Suite:
    """What `simgap run` does without options; seconds and GiB are those of a fit with its simulations."""

    name: str
    title: str
    datasets: tuple[str, ...]
    models: tuple[Entry, ...]
    tasks: tuple[str, ...] = USUAL
    seeds: int = 1
    timeout: float = 3600.0
    memory: float = 8.0


def suite_names() -> list[str]:
    """The suites that come with simgap."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load_suite(name: str) -> Suite:
    """The suite called `name`, or the one in the TOML file at that path.

    Paths inside a suite file count from where the file lies. Raises UnusableInput.
    """
    if name == STUDY:
        raise UnusableInput(f"{STUDY} is a study and no suite of models; `simgap run {STUDY}` runs it")
    path = Path(name) if name.endswith(".toml") else FOLDER / f"{name}.toml"
    if not path.is_file():
        known = ", ".join([*suite_names(), STUDY])
        raise UnusableInput(f"there is no suite {name!r}; known are {known}, or give the path of a .toml file")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:  # no TOML, or no UTF-8
        raise UnusableInput(f"{path}: {error}") from error
    return _Reader(path, table).suite()


@dataclass(frozen=True)
class _Reader:
    path: Path
    table: dict[str, Any]

    def suite(self) -> Suite:
        self._refuse_unknown(self.table, KEYS)
        suite = Suite(
            name=self.path.stem,
            title=self._get("title", str, self.path.stem),
            datasets=self._datasets(),
            models=tuple(self._models()),
            tasks=tuple(str(task) for task in self._get("tasks", list, list(USUAL))),
            seeds=self._get("seeds", int, 1),
            timeout=float(self._get("timeout", (int, float), Suite.timeout)),
            memory=float(self._get("memory", (int, float), Suite.memory)),
        )
        for task in suite.tasks:
            if task not in TASKS:
                raise UnusableInput(f"{self.path}: there is no task {task!r}; known are {', '.join(TASKS)}")
        if suite.seeds < 1 or not suite.timeout > 0 or not 0 < suite.memory < math.inf:
            raise UnusableInput(f"{self.path}: seeds, timeout and memory must be positive, and memory finite")
        return suite

    def _datasets(self) -> tuple[str, ...]:
        given = self._get("datasets", (list, str), "all")
        without = self._left_out("without", DATASETS, "data set")
        if given == "all":
            return tuple(name for name in DATASETS if name not in without)
        if "without" in self.table:
            raise UnusableInput(f'{self.path}: without goes with datasets = "all" only')
        if isinstance(given, str) or not all(isinstance(name, str) for name in given):
            raise UnusableInput(f'{self.path}: datasets must be "all" or a list of names')
        return tuple(name if name in DATASETS else self._near(name) for name in given)

    def _models(self) -> Iterable[Entry]:
        """The entries of the tables; one with the name of a model that `all` has brought takes its place."""
        given = self._get("models", (list, str), "all")
        without = self._left_out("without_models", MODELS, "model")
        tables = [{"name": "all"}] if given == "all" else given
        if isinstance(tables, str) or not all(isinstance(table, dict) for table in tables):
            raise UnusableInput(f'{self.path}: models must be "all" or tables headed [[models]]')
        usual: dict[str, Entry] = {}
        chosen: list[Entry] = []
        for table in self._without_groups(tables):
            self._refuse_unknown(table, ("name", "params", "label", "gpus"))
            entry: tuple[Any, ...] = (table.get("name", ""), table.get("params", {}), table.get("label", ""))
            if not entry[0] or [type(part) for part in entry] != [str, dict, str]:
                raise UnusableInput(f"{self.path}: a model needs a name, a table params and a text as label")
            if entry[0] == "all":
                usual = {name: Entry(name) for name in MODELS if name not in without}
            else:
                name = self._near(entry[0]) if file_of(entry[0]) else entry[0]
                chosen.append(Entry(name, *entry[1:], gpus=self._gpus(table)))
        if "without_models" in self.table and not usual:
            raise UnusableInput(f'{self.path}: without_models goes with the model "all" only')
        labels = {entry.label for entry in chosen}
        return [*(entry for label, entry in usual.items() if label not in labels), *chosen]

    def _without_groups(self, tables: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        """The tables, where each that has a `group` stands for one table per name of it."""
        groups = self._groups()
        for table in tables:
            if "group" not in table:
                yield table
                continue
            if "name" in table:
                raise UnusableInput(f"{self.path}: a model has a name or a group, not both")
            group, label = table["group"], table.get("label", "{name}")
            if not isinstance(group, str) or group not in groups:
                known = ", ".join(groups) or "none; name some under [groups]"
                raise UnusableInput(f"{self.path}: there is no group {group!r}; known are {known}")
            if not isinstance(label, str) or "{name}" not in label:
                raise UnusableInput(f"{self.path}: the label {label!r} of a group needs {{name}} in it")
            for name in groups[group]:
                own = label.replace("{name}", name.rpartition(":")[2])
                yield {key: value for key, value in table.items() if key != "group"} | {"name": name, "label": own}

    def _groups(self) -> dict[str, list[str]]:
        groups = self.table.get("groups", {})
        if not isinstance(groups, dict):
            raise UnusableInput(f"{self.path}: groups must be a table of lists of names, headed [groups]")
        for name, members in groups.items():
            if not isinstance(members, list) or not members or not all(isinstance(m, str) and m for m in members):
                raise UnusableInput(f"{self.path}: the group {name} must be a list of names of models")
            if "all" in members:
                raise UnusableInput(f"{self.path}: the group {name} cannot hold all; give all a table of its own")
        return groups

    def _left_out(self, key: str, registry: Registry, kind: str) -> list[str]:
        """The registered names under the key, that "all" does not bring."""
        names = self._get(key, list, [""])
        for name in names:
            if name and name not in registry:
                raise UnusableInput(f"{self.path}: {key}: there is no registered {kind} {name!r}")
        return names

    def _gpus(self, table: dict[str, Any]) -> float:
        gpus = table.get("gpus", 0.0)
        if not isinstance(gpus, int | float) or isinstance(gpus, bool) or not 0 <= gpus <= 64:
            raise UnusableInput(f"{self.path}: gpus is {gpus!r}; give a number such as 0.25")
        return float(gpus)

    def _near(self, name: str) -> str:
        """`name`, a path or `file.py:Class`, from the suite's own folder if there is such a file."""
        near = self.path.parent / name
        file = Path(file_of(str(near)) or near)
        try:
            return str(near) if file.exists() else name
        except (OSError, ValueError):  # a name that no file can have
            return name

    def _get(self, name: str, kind: Any, default: Any) -> Any:
        value = self.table.get(name, default)
        if value == []:
            raise UnusableInput(f"{self.path}: the list of {name} is empty")
        if not isinstance(value, kind) or isinstance(value, bool):
            raise UnusableInput(f"{self.path}: {name} is {value!r}, which is of the wrong type")
        return value

    def _refuse_unknown(self, table: dict[str, Any], known: tuple[str, ...]) -> None:
        for name in table:
            if name not in known:
                raise UnusableInput(f"{self.path}: unknown key {name!r}; known are {', '.join(known)}")
