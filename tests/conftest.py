"""Shapes and types of every public function are checked while the tests run, and only then."""

import os
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

ROOT = Path(__file__).parents[1]
FOLDERS = {"benchmark": "simgap", "baselines": "simgap.baselines", "neural": "simgap.neural",
           "data": "simgap.data", "reports": "simgap.reports"}  # fmt: skip
# Called a hundred thousand times by one search; checks would make them five times as slow.
INSIDE_A_FIT = ("grey.least_squares", "grey.simulation", "grey.structure")


def _modules() -> list[str]:
    """Every module but the command line, numba kernels (a checked function cannot be compiled) and a fit's inside."""
    names = []
    for folder, package in FOLDERS.items():
        for path in (ROOT / folder).rglob("*.py"):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            inside = path.stem.endswith("kernels") or ".".join(parts) in INSIDE_A_FIT
            if not inside and "cli" not in parts and path.stem != "__init__":
                names.append(".".join((package, *parts)))
    return names


install_import_hook(_modules(), "beartype.beartype")


@pytest.fixture(scope="session")
def measured() -> Path:
    """The folder of measured data sets, which are not part of the repository."""
    folder = Path(os.environ.get("SIMGAP_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("no measured data here: set SIMGAP_DATA to the folder that holds them")
    return folder
