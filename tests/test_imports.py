"""Who may import whom, read from the files with ast (the table is in floor_plan.py)."""

import ast
from pathlib import Path

import pytest
from floor_plan import MAY_IMPORT, modules

MODULES = modules()


def room_of(module: str) -> str:
    """ "simgap.data.loading" -> "data", "simgap.metrics" -> "metrics", "simgap" -> "simgap"."""
    return module.split(".")[1] if "." in module else "simgap"


def imports(path: Path) -> set[str]:
    """The simgap modules that a file imports anywhere, inside functions and for type checking included."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Import(names=names):
                found |= {alias.name for alias in names}
            case ast.ImportFrom(module=str(module), names=names, level=0):
                found |= {f"{module}.{a.name}" if f"{module}.{a.name}" in MODULES else module for a in names}
            case ast.ImportFrom():
                raise AssertionError(f"{path}: imports are absolute, so that they can be read")
    return {name for name in found if name == "simgap" or name.startswith("simgap.")}


IMPORTS = {module: imports(path) - {module} for module, path in MODULES.items()}


def circle(arrows: dict[str, set[str]]) -> list[str]:
    """Some circle of a graph, empty if it has none."""
    done: set[str] = set()

    def visit(node: str, way: list[str]) -> list[str]:
        if node in way:
            return [*way[way.index(node) :], node]
        if node in done:
            return []
        for following in sorted(arrows.get(node, ())):
            if found := visit(following, [*way, node]):
                return found
        done.add(node)
        return []

    return next(filter(None, (visit(node, []) for node in arrows)), [])


@pytest.mark.parametrize("module", MODULES)
def test_every_module_imports_only_what_lies_below_it(module):
    room = room_of(module)
    assert room in MAY_IMPORT, f"{module} is new: say in floor_plan.py what it may import"
    allowed = {f"simgap.{name}".removesuffix(".simgap") for name in MAY_IMPORT[room] | {room}}
    too_much = {
        name for name in IMPORTS[module]
        if name not in allowed and not any(name.startswith(f"{prefix}.") for prefix in allowed - {"simgap"})
    }  # fmt: skip
    assert not too_much, f"{module} imports {sorted(too_much)}"


def test_rooms_import_each_other_in_no_circle():
    rooms: dict[str, set[str]] = {}
    for module, others in IMPORTS.items():
        rooms.setdefault(room_of(module), set()).update(map(room_of, others))
    assert not circle({room: others - {room} for room, others in rooms.items()})


def test_modules_import_each_other_in_no_circle():
    packages = {module for module, path in MODULES.items() if path.stem == "__init__"}
    # What a package exports lazily, or for readers, is no arrow of its own.
    assert not circle({module: others - packages for module, others in IMPORTS.items()})


@pytest.mark.parametrize("room", ["baselines", "neural"])
def test_models_are_reached_only_by_name(room):
    for module in MODULES:
        if room_of(module) != room:
            assert room not in {room_of(name) for name in IMPORTS[module]}, f"{module} imports {room}"


def test_nobody_imports_the_command_line():
    for module in MODULES:
        if room_of(module) not in ("cli", "__main__"):
            assert "cli" not in {room_of(name) for name in IMPORTS[module]}, f"{module} imports the command line"


def test_a_circle_is_found():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert not circle({"a": {"b", "c"}, "b": {"c"}, "c": set()})
