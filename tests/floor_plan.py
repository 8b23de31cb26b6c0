"""The folders, the names they import as, and who may import whom; the tests of imports and packaging share it."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = {"benchmark": "simgap", "baselines": "simgap.baselines", "neural": "simgap.neural",
           "data": "simgap.data", "reports": "simgap.reports"}  # fmt: skip

GROUND = {"records", "known_plant", "protocol", "registry", "step_form", "cores", "stages", "units"}
RUN = {"metrics", "tasks", "results", "running"}
# Room or module -> what it may import besides itself. "simgap" is the lazy exports of the package.
MAY_IMPORT: dict[str, set[str]] = {
    "known_plant": set(),
    "units": set(),
    "records": {"known_plant"},
    "cores": set(),
    "stages": set(),
    "their_simulation": set(),
    "findings": {"records", "their_simulation", "error_views"},
    "wording": set(),
    "protocol": {"records"},
    "step_form": {"records"},
    "registry": {"records"},
    "metrics": {"records"},
    "tasks": {"records", "metrics"},
    "data": GROUND,
    "results": GROUND | {"metrics", "tasks"},
    "running": GROUND | {"metrics", "tasks", "results", "data"},
    "subspace": {"records"},
    "greybox": GROUND | {"findings", "error_views", "subspace"},
    "error_views": {"records", "metrics", "units", "wording"},
    "baselines": GROUND | {"metrics", "data", "error_views", "greybox", "subspace"},
    "neural": GROUND | {"data"},
    "saved": GROUND | RUN | {"data"},
    "exports": GROUND | RUN | {"data", "greybox", "saved"},
    "contract": GROUND | RUN | {"data", "saved"},
    # The site shows signals from the user's copy of a data set, and what a model is.
    "reports": {"records", "registry", "metrics", "results", "data", "wording"}
    | {"findings", "error_views", "greybox.effects"},
    # An answer shows itself in a notebook, so that diagnosis lies above reports.
    "diagnosis": GROUND
    | RUN
    | {"findings", "their_simulation", "data", "greybox", "error_views", "reports", "wording"},
    "recovery": GROUND | RUN | {"findings", "data", "diagnosis"},
    "experiment_design": GROUND | {"data", "diagnosis", "greybox", "wording"},
    "simgap": GROUND | RUN | {"data", "diagnosis", "experiment_design", "exports", "reports", "saved"},
    # The page of `simgap open` does what the command line does, for one record at a time.
    "app": GROUND | {"data", "diagnosis", "reports", "saved", "wording"},
    "cli": GROUND
    | RUN
    | {"app", "contract", "experiment_design", "exports", "findings", "data", "greybox", "diagnosis", "recovery"}
    | {"reports", "saved"}
    | {"simgap"},
    "__main__": {"cli"},
}


def modules() -> dict[str, Path]:
    """Every module of the distribution and its file."""
    found = {}
    for folder, package in FOLDERS.items():
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            found[".".join((package, *parts)).removesuffix(".__init__")] = path
    return found
