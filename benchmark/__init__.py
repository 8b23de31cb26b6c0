"""simgap: classical and neural system identification on one bench, by free-run simulation."""

from __future__ import annotations

import importlib
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simgap.data import Missing, describe, fetch, load, save
    from simgap.diagnosis.diagnose import diagnose
    from simgap.experiment_design.choice import choose_record
    from simgap.experiment_design.next_record import next_record
    from simgap.exports.export import Verification, export, verify
    from simgap.protocol import Model
    from simgap.records import Channel, Channels, Dataset, Experiment, Result, TrainingSet, UnusableInput
    from simgap.registry import DATASETS, EFFECTS, MODELS
    from simgap.reports.figures import write_figures
    from simgap.reports.leaderboard import report
    from simgap.reports.site.site import write_site
    from simgap.results.regression import Regression, check
    from simgap.running.execution import Progress
    from simgap.running.fitting import Fit, fit
    from simgap.running.runner import run
    from simgap.running.suites import Suite, load_suite
    from simgap.running.tuning import Range, tune
    from simgap.saved.archive import load_model, save_model
    from simgap.saved.simulate import Simulation, simulate

_HOME = {
    "simgap.data": ("Missing", "describe", "fetch", "load", "save"),
    "simgap.diagnosis.diagnose": ("diagnose",),
    "simgap.experiment_design.choice": ("choose_record",),
    "simgap.experiment_design.next_record": ("next_record",),
    "simgap.exports.export": ("Verification", "export", "verify"),
    "simgap.running.fitting": ("Fit", "fit"),
    "simgap.protocol": ("Model",),
    "simgap.records": (
        "Channel", "Channels", "Dataset", "Experiment", "Result", "TrainingSet", "UnusableInput",
    ),
    "simgap.results.regression": ("Regression", "check"),
    "simgap.registry": ("DATASETS", "EFFECTS", "MODELS"),
    "simgap.reports.figures": ("write_figures",),
    "simgap.reports.leaderboard": ("report",),
    "simgap.reports.site.site": ("write_site",),
    "simgap.running.execution": ("Progress",),
    "simgap.running.runner": ("run",),
    "simgap.running.suites": ("Suite", "load_suite"),
    "simgap.running.tuning": ("Range", "tune"),
    "simgap.saved.archive": ("load_model", "save_model"),
    "simgap.saved.simulate": ("Simulation", "simulate"),
}  # fmt: skip
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "DATASETS", "EFFECTS", "MODELS", "Channel", "Channels", "Dataset", "Experiment", "Fit", "Missing", "Model",
    "Progress", "Range", "Regression", "Result", "Simulation", "Suite", "TrainingSet", "UnusableInput", "Verification",
    "check", "choose_record", "describe", "diagnose", "export", "fetch", "fit", "load", "load_model", "load_suite",
    "next_record", "report", "run", "save", "save_model", "simulate", "tune", "verify", "write_figures", "write_site",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import a part on its first use, so that `import simgap` stays fast."""
    if name == "__version__":
        return version("simgap")
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'simgap' has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
