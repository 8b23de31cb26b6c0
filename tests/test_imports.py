"""Who may import whom, read from the files with ast (design, section 1)."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = {"benchmark": "simgap", "baselines": "simgap.baselines", "neural": "simgap.neural",
           "data": "simgap.data", "reports": "simgap.reports"}  # fmt: skip
PARTS = ("baselines", "neural", "data", "reports", "cli", "effects", "diagnosis", "engines")
CONTRACTS = {"records", "protocol", "registry"}
BENCH = {"metrics", "tasks", "store", "suites", "workers", "provenance", "fitting", "jobs", "planning",
         "runner", "engines", "contract"}  # fmt: skip
EVERYTHING = CONTRACTS | BENCH | {"findings", "regression", "data", "effects", "diagnosis", "reports", "simgap"}

# part or module -> what it may import besides itself; "simgap" is the package's own version and lazy exports
ALLOWED = {
    **dict.fromkeys(CONTRACTS, CONTRACTS),
    "data": CONTRACTS,
    "effects": CONTRACTS,
    "neural": CONTRACTS | {"data"},
    "baselines": CONTRACTS | {"data", "effects"},
    "findings": set(),
    "regression": CONTRACTS | {"store", "suites"},
    "reports": {"records", "metrics", "store", "findings", "effects", "regression"},
    **dict.fromkeys(BENCH, CONTRACTS | BENCH | {"data", "simgap"}),
    "metrics": {"records"},
    "tasks": {"records", "metrics"},
    "store": {"records"},
    "workers": set(),
    "suites": CONTRACTS | {"tasks", "store"},
    # An answer shows itself in a notebook.
    "diagnosis": CONTRACTS | BENCH | {"findings", "data", "effects", "reports"},
    "cli": EVERYTHING,
    "simgap": EVERYTHING,
}


def part_of(module: str) -> str:
    """ "simgap.data.loading" -> "data", "simgap.store" -> "store", "simgap" -> "simgap"."""
    return module.split(".")[1] if "." in module else "simgap"


def modules() -> dict[str, Path]:
    """Every module of the distribution and its file."""
    found = {}
    for folder, package in FOLDERS.items():
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            found[".".join((package, *parts)).removesuffix(".__init__")] = path
    return found


MODULES = modules()


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


@pytest.mark.parametrize("module", MODULES)
def test_every_module_imports_only_what_lies_below_it(module):
    part = part_of(module)
    assert part in ALLOWED, f"{module} is new: say in this test what it may import"
    too_much = {name for name in imports(MODULES[module]) if part_of(name) not in ALLOWED[part] | {part}}
    assert not too_much, f"{module} imports {sorted(too_much)}"


@pytest.mark.parametrize("part", ["baselines", "neural"])
def test_models_are_reached_only_by_name(part):
    for module, path in MODULES.items():
        if part_of(module) != part:
            assert part not in {part_of(name) for name in imports(path)}, f"{module} imports {part}"


def test_nobody_imports_the_command_line():
    for module, path in MODULES.items():
        if part_of(module) != "cli":
            assert "cli" not in {part_of(name) for name in imports(path)}, f"{module} imports the command line"


def test_a_part_is_known_to_this_test():
    parts = {part_of(module) for module in MODULES}
    assert parts <= set(ALLOWED) | set(PARTS)
