"""`export`: a fitted model into a folder for another simulator; `verify`: run it there and compare."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simgap.data import load
from simgap.data.formats.plant_table import read_forces, with_known
from simgap.data.measured.locations import one_line
from simgap.exports import subjects
from simgap.exports.folders import ABOUT, read_folder, write_folder
from simgap.exports.subjects import Subject
from simgap.greybox.model import GreyBoxModel
from simgap.records import Dataset, Experiment, UnusableInput
from simgap.running import fitting
from simgap.saved.archive import FittedOn, SavedModel, read_saved
from simgap.saved.simulate import matching_experiments

FORMATS = tuple(sorted(path.stem for path in (Path(__file__).parent / "formats").glob("[a-z]*.py")))


@dataclass(frozen=True)
class Verification:
    """The largest RMS difference from our free run over the signal's standard deviation, per record, and its limit."""

    format: str
    differences: dict[str, float]
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the target repeats every record within the limit."""
        return all(difference <= self.limit for difference in self.differences.values())

    def __str__(self) -> str:
        parts = [f"{name} differs by {difference:.2g}" for name, difference in self.differences.items()]
        return (
            f"{self.format}: {', '.join(parts)} (RMS over the standard deviation; the limit is {self.limit:g}): "
            f"{'the same free run' if self.passed else 'NOT the same free run'}"
        )


def export(
    model: str | Path | SavedModel, data: Any, to: str, out: str | Path, params: dict[str, Any] | None = None,
    seed: int = 0, experiment: str | None = None, dt: float | None = None, known: Mapping[str, Any] | None = None,
    into: str | Path | None = None, joint: str = "", resample: float | None = None, split_gaps: bool = False,
) -> Verification:  # fmt: skip
    """Write a model as another simulator reads it, into a new folder, with records and their expected answers; run it.

    `model` is a saved model, or the name of one that is fitted first; `data` what it is fitted on, or records of the
    same machine; `known` what is known of it, as a table [plant] says it: a model that is fitted first is fitted with
    it, a saved one takes its inertia from there, or from a torque constant; `into` the user's own MJCF, into a copy of
    which mjcf writes the joint of that name too. The record is the first test experiment, or the one called
    `experiment`; dt in s, for files without a column of time; `resample` and `split_gaps` are those of `simgap.load`.
    Raises UnusableInput where the format does not take such a model, or what runs it is missing.
    """
    target, out = check_target(to, out, into), Path(out)
    subject = _subject(model, data, to, params or {}, seed, experiment, (dt, resample, split_gaps), dict(known or {}))
    if hasattr(target, "prepare"):
        subject = target.prepare(subject)
    limit = target.check(subject) if hasattr(target, "check") else subject.limit
    files = {} if into is None else target.patch(subject, Path(into), joint)
    out.mkdir(parents=True, exist_ok=True)
    try:
        write_folder(subject, to, out, limit)
        target.write(subject, out)
        for name, text in files.items():
            (out / name).write_text(text, encoding="utf-8")
        return verify(out)
    except BaseException:
        shutil.rmtree(out)  # it was new or empty, and half an export is none
        raise


def verify(folder: str | Path) -> Verification:
    """Run an export in its target over its records, and compare with the expected answers. Raises UnusableInput."""
    folder = Path(folder)
    about = read_folder(folder)
    target = _format(about.format)
    if missing := target.missing():
        raise UnusableInput(f"{about.format}: {missing}")
    try:
        differences = {one.name: one.difference(target.run(folder, about, one)) for one in about.records}
    except UnusableInput:
        raise
    except Exception as error:  # somebody may have changed or cut what is in the folder
        raise UnusableInput(f"{folder}: what is there does not run as {about.format}: {one_line(error)}") from error
    if not differences:
        raise UnusableInput(f"{folder / ABOUT} names no record to compare with")
    return Verification(about.format, differences, about.limit)


def check_target(to: str, out: str | Path, into: str | Path | None = None) -> Any:
    """Return the module of a format. Raises UnusableInput where what runs it is missing, or the folder is not new."""
    target, out = _format(to), Path(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UnusableInput(f"{out} exists already; export into a new folder")
    if missing := target.missing():
        raise UnusableInput(f"--to {to}: {missing}")
    if into is not None and not hasattr(target, "patch"):
        raise UnusableInput(f"--into {into}: only --to mjcf writes into another file")
    return target


def refusal(model: str, kind: type, to: str) -> str:
    """Say why a format does not take the models of a class, and what does; empty where it takes them."""
    if not (reason := _format(to).refusal(kind)):
        return ""
    others = [form for form in FORMATS if form != to and not _format(form).refusal(kind)]
    return f"{model} cannot be exported to {to}: {reason}; " + (
        f"it can be to {', '.join(others)}" if others else "no other format takes it either"
    )


def check_model(model: str, to: str) -> type:
    """Return the class behind a name. Raises UnusableInput where the format does not take such models."""
    kind = fitting.model_class(model)
    if reason := refusal(model, kind, to):
        raise UnusableInput(reason)
    return kind


def _format(name: str) -> Any:
    if name not in FORMATS:
        raise UnusableInput(f"--to {name}: there is no such format; there are {', '.join(FORMATS)}")
    return importlib.import_module(f"simgap.exports.formats.{name}")


def _subject(
    model: str | Path | SavedModel, data: Any, to: str, params: dict[str, Any], seed: int,
    experiment: str | None, reading: tuple[float | None, float | None, bool], known: dict[str, Any],
) -> Subject:  # fmt: skip
    if isinstance(model, SavedModel) or is_saved(model):
        saved = model if isinstance(model, SavedModel) else read_saved(model)
        name, fitted, about = saved.name, saved.model, saved.fitted_on
        if known and isinstance(fitted, GreyBoxModel) and fitted.plants[0].estimate.plant.machine is not None:
            raise UnusableInput(f"--known: {name} was fitted with its table [plant]; leave it out, or fit again")
        forces = read_forces(known)
        if reason := refusal(name, type(fitted), to):
            raise UnusableInput(reason)
        if isinstance(data, Dataset):
            x, seen = _record(data, experiment), data.training.train + data.training.valid + data.test
        else:
            x = matching_experiments(about, data, experiment, *reading)[0]
            seen = matching_experiments(about, data, None, *reading, every=True)
    else:
        check_model(str(model), to)  # first, because data and a fit take their time
        torque_constant = {key: known.pop(key) for key in ("torque_constant",) if key in known}
        dt, resample, split_gaps = reading
        dataset = data if isinstance(data, Dataset) else load(data, dt=dt, resample=resample, split_gaps=split_gaps)
        dataset = with_known(dataset, known)
        forces = read_forces(torque_constant)
        name, about = str(model).rpartition(":")[2], FittedOn.of(dataset)
        fitted = fitting.build(str(model), params)
        x = _record(dataset, experiment)
        fitted.fit(dataset.training, seed)
        seen = dataset.training.train + dataset.training.valid
    of_u, of_y = subjects.ranges(seen)
    records = [
        subjects.measured_record(name, fitted, about, x),
        subjects.friction_record(fitted, about, abs(of_u).max(axis=0), x),
    ]
    return Subject(name, fitted, about, tuple(one for one in records if one is not None), of_u, of_y, forces)


def _record(data: Dataset, name: str | None) -> Experiment:
    known = data.test + data.training.train + data.training.valid
    if name is None:
        return known[0]
    if found := [x for x in known if x.name == name]:
        return found[0]
    raise UnusableInput(f"there is no experiment {name!r}; there are {', '.join(x.name for x in known)}")


def is_saved(model: str | Path) -> bool:
    """Tell whether a model is given as a file that holds a fitted one, not by its name or as file.py:Class."""
    return Path(model).is_file() and Path(model).suffix != ".py"
