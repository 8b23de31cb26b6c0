"""Names for models, effects, data sets, engines and adapters. A new one is one new file with one decorator."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from simgap.records import UnusableInput

T = TypeVar("T")


def origin(target: Any) -> tuple[str, str]:
    """Where a thing was defined; a module that is imported again defines the same thing."""
    return target.__module__, target.__qualname__


@dataclass(frozen=True)
class _Entry:
    """The module that registers a name, and the first line of its docstring."""

    module: str
    title: str


@dataclass
class Registry:
    """Things of one kind by name, found by scanning packages for `@REGISTRY.register("name")`.

    The scan reads the files without running them, so listing names imports nothing and asking for one name
    imports one module. A module that cannot be imported spoils only its own names.
    """

    kind: str
    packages: tuple[str, ...]
    constant: str
    _targets: dict[str, Any] = field(default_factory=dict)
    _entries: dict[str, _Entry] | None = None
    _installed: dict[str, Any] | None = None

    def register(self, name: str) -> Callable[[T], T]:
        """Class or function decorator that files its target under `name`; a name taken twice is an error."""

        def add(target: T) -> T:
            taken = self._targets.get(name)
            if taken is not None and origin(taken) != origin(target):
                raise ValueError(f"two {self.kind}s are called {name!r}: {taken!r} and {target!r}")
            self._targets[name] = target
            return target

        return add

    def name_of(self, target: Any) -> str:
        """The name under which `target` was registered. Raises UnusableInput."""
        for name, registered in self._targets.items():
            if registered is target:
                return name
        for name, point in self._plugins().items():
            if point.value == ":".join(origin(target)):
                return name
        raise UnusableInput(f"{target!r} is no registered {self.kind}")

    def names(self) -> list[str]:
        """All names, those of importable and of broken modules alike, in alphabetical order."""
        return sorted({*self._index(), *self._targets, *self._plugins()})

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __contains__(self, name: str) -> bool:
        return name in self.names()

    def __getitem__(self, name: str) -> Any:
        """The thing called `name`. Raises UnusableInput for an unknown name or a module that does not import."""
        if name in self._targets:
            return self._targets[name]
        if name in self._index():
            module = self._index()[name].module
            try:
                importlib.import_module(module)
            except Exception as error:  # a file under work may fail in any way
                raise UnusableInput(f"{self.kind} {name} is not available: {error}") from error
            return self._targets[name]
        if name in self._plugins():
            try:
                return self._plugins()[name].load()
            except Exception as error:  # so may a stranger's package
                raise UnusableInput(f"{self.kind} {name} is not available: {error}") from error
        alike = get_close_matches(name, self.names(), n=2)
        meant = f" is {' or '.join(alike)} meant?" if alike else ""
        raise UnusableInput(f"there is no {self.kind} called {name!r};{meant} known are {', '.join(self.names())}")

    def module(self, name: str) -> str:
        """The module of simgap that defines it; empty for somebody's own."""
        return self._index()[name].module if name in self._index() else ""

    def title(self, name: str) -> str:
        """The first line of its docstring; nothing is imported unless it comes from somebody's own package."""
        if name in self._index():
            return self._index()[name].title
        return next(iter((self[name].__doc__ or "").strip().splitlines()), "")

    def why_missing(self, name: str) -> str:
        """Empty when `name` can be used, else the reason why not.

        Where a package says what it REQUIRES, that is looked for instead of importing what takes seconds.
        """
        package = self.module(name).rpartition(".")[0]
        required = getattr(importlib.import_module(package), "REQUIRES", ()) if package else ()
        if missing := [part for part in required if importlib.util.find_spec(part) is None]:
            return f"{self.kind} {name} is not available: {', '.join(missing)} is not installed"
        if required:
            return ""
        try:
            self[name]
        except UnusableInput as error:
            return str(error)
        return ""

    def _plugins(self) -> dict[str, Any]:
        if self._installed is None:
            group = f"simgap.{self.kind.replace(' ', '')}s"
            self._installed = {point.name: point for point in entry_points(group=group)}
        return self._installed

    def _index(self) -> dict[str, _Entry]:
        if self._entries is None:
            self._entries = {}
            for package in self.packages:
                for module, path in _files(package):
                    for name, title in _registered(path, self.constant):
                        self._entries[name] = _Entry(module, title)
        return self._entries


def _files(package: str) -> Iterator[tuple[str, Path]]:
    spec = importlib.util.find_spec(package)
    for folder in (spec.submodule_search_locations if spec else None) or ():
        for path in sorted(Path(folder).glob("*.py")):
            yield f"{package}.{path.stem}", path


def _registered(path: Path, constant: str) -> Iterator[tuple[str, str]]:
    """Names that decorators of a file register, each with the first line of what it decorates says of itself."""
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"))
    except SyntaxError:
        return  # importing the file by hand tells its author more than we could
    for node in ast.walk(tree):
        if not isinstance(node, ast.ClassDef | ast.FunctionDef):
            continue
        for decorator in node.decorator_list:
            match decorator:
                case ast.Call(
                    func=ast.Attribute(value=ast.Name(id=registry), attr="register"),
                    args=[ast.Constant(value=str(name))],
                ) if registry == constant:
                    yield name, next(iter((ast.get_docstring(node) or "").splitlines()), "")


MODELS = Registry("model", ("simgap.baselines", "simgap.neural"), "MODELS")
EFFECTS = Registry("effect", ("simgap.greybox.effects",), "EFFECTS")
ADAPTERS = Registry("adapter", ("simgap.recovery.adapters",), "ADAPTERS")
ENGINES = Registry("engine", ("simgap.running.engines",), "ENGINES")
DATASETS = Registry(
    "dataset", ("simgap.data.measured", "simgap.data.simulated", "simgap.data.simulated.gimbal"), "DATASETS"
)


def file_of(reference: str) -> str:
    """The file in `path/to/file.py:Class` or `path/to/file.py`; empty for a registered name."""
    if ".py:" in reference:
        return reference.rpartition(":")[0]
    return reference if reference.endswith(".py") else ""


def load_class(reference: str) -> type:
    """The class behind `path/to/file.py:Class`, or the only model of `path/to/file.py`. Raises UnusableInput."""
    file = file_of(reference)
    path, name = Path(file), reference.removeprefix(file).removeprefix(":")
    if not file:
        raise UnusableInput(f"--model {reference}: write it as path/to/my_model.py:MyModel")
    if not path.is_file():
        raise UnusableInput(f"--model {reference}: there is no file {path}")
    module_name = f"simgap_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path)
    assert spec is not None and spec.loader is not None  # a .py file that exists always has a loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module  # dataclasses look their module up there
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise UnusableInput(f"--model {reference}: the file does not import: {error!r}") from error
    if not name:
        name = _only_model(module, reference)
    if not isinstance(getattr(module, name, None), type):
        raise UnusableInput(f"--model {reference}: {path} holds no class {name}")
    return getattr(module, name)


def _only_model(module: ModuleType, reference: str) -> str:
    own = [thing for thing in vars(module).values() if getattr(thing, "__module__", "") == module.__name__]
    models = [thing.__name__ for thing in own if hasattr(thing, "fit") and hasattr(thing, "simulate")]
    if len(models) != 1:
        content = f"the classes {', '.join(models)}" if models else "no class with the methods fit and simulate"
        raise UnusableInput(f"--model {reference}: the file holds {content}; write it as {reference}:MyModel")
    return models[0]
