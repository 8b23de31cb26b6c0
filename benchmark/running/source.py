"""The code behind a model or a study: its module and what that imports, read from the files without running them."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from simgap.registry import EFFECTS, MODELS

# What models rely on without being digested; a change there that alters what models compute counts this up.
CONTRACT = 1
CONTRACT_MODULES = ("simgap", "simgap.records", "simgap.protocol", "simgap.registry", "simgap.step_form")

_IMPORT = re.compile(r"(?:^|[:;])[ \t]*((?:from|import)[ \t][^(\n]*(?:\([^)]*\))?)", re.MULTILINE)
_FOR_READERS = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+", re.MULTILINE)
_MODEL_BY_NAME = re.compile(r"MODELS\[[\"']([^\"']+)[\"']\]")


@dataclass(frozen=True)
class Code:
    """The modules of a closure of imports, each with the digest of its file, and the packages imported beside them."""

    digests: dict[str, str]
    outside: frozenset[str]

    def sha256(self) -> str:
        """Digest of names and contents, the same wherever the files lie."""
        lines = [f"contract {CONTRACT}", *(f"{name} {digest}" for name, digest in sorted(self.digests.items()))]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()


@dataclass(frozen=True)
class _Module:
    """The digest of a module's file, and the names of what it imports or reaches through a registry."""

    sha256: str
    imported: tuple[str, ...]


def code_of(classes: Iterable[type]) -> Code:
    """Collect the code that the classes stand on: modules of simgap, and those beside the file of a user's class."""
    code = Code({}, frozenset())
    for kind in classes:
        file, name = Path(inspect.getfile(kind)), kind.__module__
        added = closure({name: file}, root=None if _is_simgap(name) else file.parents[name.count(".")])
        # One file of a user's may hold several models.
        of_class = {} if _is_simgap(name) else {f"class {kind.__qualname__}": ""}
        code = Code(code.digests | added.digests | of_class, code.outside | added.outside)
    return code


def closure(start: dict[str, Path | None], root: Path | None = None, within: tuple[str, ...] = ("simgap",)) -> Code:
    """Collect what the modules in `start` import, directly or by way of others, function-level imports included.

    `start` maps a name to its file, None for a module of simgap. `root` is the folder in which a user's own modules
    are looked up; beside an installed package, only its own. `within` are the packages of simgap that are followed;
    the contract is not.
    """
    digests: dict[str, str] = {}
    outside: set[str] = set()
    packages = root is not None and root.name in ("site-packages", "dist-packages")
    own = {name.partition(".")[0] for name in start}
    todo = dict(start)
    while todo:
        name, path = todo.popitem()
        if name in digests:
            continue
        top = name.partition(".")[0]
        path = path or _find(name, None if packages and top not in own else root)
        if path is None:
            outside.add(top)
            continue
        stat = path.stat()
        module = _read(name, path, stat.st_mtime_ns, stat.st_size)
        digests[name] = module.sha256
        todo |= {one: None for one in module.imported if not _is_simgap(one) or _followed(one, within)}
    return Code(digests, frozenset(outside))


def _followed(name: str, within: tuple[str, ...]) -> bool:
    return name not in CONTRACT_MODULES and any(name == room or name.startswith(f"{room}.") for room in within)


@cache
def _read(name: str, path: Path, changed_ns: int, size: int) -> _Module:
    """Read a file, anew when it has changed.

    Only the import statements are parsed, which is ten times as fast; where one cannot be told, the whole file is.
    """
    content = path.read_bytes()
    text = _FOR_READERS.sub("", content.decode("utf-8", "replace"))
    try:
        tree = ast.parse("\n".join(match.strip() for match in _IMPORT.findall(text)))
    except SyntaxError:
        tree = ast.parse(text)
    package = name if path.stem == "__init__" else name.rpartition(".")[0]
    imported = [one for node in ast.walk(tree) for one in _names_in(node, package)]
    if "simgap.registry.EFFECTS" in imported and package not in EFFECTS.packages:
        imported += [EFFECTS.module(effect) for effect in EFFECTS]
    imported += filter(None, map(MODELS.module, _MODEL_BY_NAME.findall(text)))
    return _Module(hashlib.sha256(content).hexdigest(), tuple(dict.fromkeys(imported)))


def _names_in(node: ast.AST, package: str) -> Iterator[str]:
    """The modules that a statement imports; `from a import b` may mean the module a.b."""
    match node:
        case ast.Import(names=names):
            yield from (alias.name for alias in names)
        case ast.ImportFrom(module=module, names=names, level=level):
            parts = package.split(".")[: 1 - level or None] if level else []
            base = ".".join([*parts, *([module] if module else [])])
            for alias in names:
                yield from (base, f"{base}.{alias.name}")


def _is_simgap(name: str) -> bool:
    return name == "simgap" or name.startswith("simgap.")


def _find(name: str, root: Path | None) -> Path | None:
    if _is_simgap(name):
        return _of_simgap(name)
    return _in_folder(root, name.split(".")) if root is not None else None


@cache
def _of_simgap(name: str) -> Path | None:
    """The file of a module or package of simgap, whose folders are no tree of packages."""
    parent, _, last = name.rpartition(".")
    folder = _folder(parent)
    file = _in_folder(folder, [last]) if folder else None
    if file is None and parent in ("", "simgap") and (folder := _folder(name)):
        return folder / "__init__.py"
    return file


@cache
def _folder(package: str) -> Path | None:
    """The folder of a package of simgap; None for what is none."""
    parent, _, last = package.rpartition(".")
    if parent not in ("", "simgap"):
        above = _folder(parent)
        return above / last if above is not None and (above / last).is_dir() else None
    spec = importlib.util.find_spec(package) if package else None
    return Path(next(iter(spec.submodule_search_locations))) if spec and spec.submodule_search_locations else None


def _in_folder(folder: Path, parts: list[str]) -> Path | None:
    for path in (folder.joinpath(*parts[:-1], f"{parts[-1]}.py"), folder.joinpath(*parts, "__init__.py")):
        if path.is_file():
            return path
    return None
