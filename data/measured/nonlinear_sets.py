"""The measured sets of nonlinearbenchmark.org, read by the package nonlinear_benchmarks, officially split.

Experiments keep all their samples; the package's state_initialization_window_length becomes n_init. The last
quarter of each training record validates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from simgap.data.measured.locations import reads
from simgap.data.splits import assemble, hold_out_tails
from simgap.records import Channel, Channels, Dataset, Experiment
from simgap.registry import DATASETS

SITE = "https://www.nonlinearbenchmark.org"


def _package(benchmark: str) -> Callable[..., Any]:
    import nonlinear_benchmarks  # imports requests, which is slow

    return getattr(nonlinear_benchmarks, benchmark)


def _download(benchmark: str, folder: Path) -> None:
    """Let the package download its files into `folder`."""
    _package(benchmark)(dir_placement=folder, data_file_locations=True)


def _official(benchmark: str, folder: Path) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Read the package's training and test records. All files must be there, or the package would download."""
    train, test = _package(benchmark)(dir_placement=folder, atleast_2d=True, always_return_tuples_of_datasets=True)
    return tuple(train), tuple(test)


def _dataset(name: str, train: dict[str, Any], test: dict[str, Any], channels: Channels) -> Dataset:
    heads, tails = hold_out_tails(_experiments(train))
    n_init = {record.state_initialization_window_length for record in test.values()}
    assert len(n_init) == 1, f"{name}: the package scores its test records from different samples on: {n_init}"
    return assemble(name, (heads, tails, _experiments(test)), channels, n_init.pop(), name)


def _experiments(records: dict[str, Any]) -> list[Experiment]:
    # float(): the sampling time of the tanks is an np.uint8
    return [Experiment(name, r.u, r.y, float(r.sampling_time)) for name, r in records.items()]


def _named(names: Sequence[str], records: tuple[Any, ...]) -> dict[str, Any]:
    """Name records by their position, because slices of the package's records lose their names."""
    return dict(zip(names, records, strict=True))


def _channels(u: Channel, y: Channel) -> Channels:
    return Channels((u,), (y,))


@DATASETS.register("cascaded_tanks")
@reads(
    "nonlinear_benchmarks",
    "Cascaded_Tanks/CascadedTanksFiles.zip",
    "Cascaded_Tanks/CascadedTanksFiles/dataBenchmark.mat",
    download=partial(_download, "Cascaded_Tanks"),
    where=f"{SITE}/benchmarks/cascaded-tanks",
)
def cascaded_tanks(folder: Path) -> Dataset:
    """Cascaded tanks with overflow: two tanks, one above the other, fed by a pump

    Machine: water runs from the upper tank through an opening into the lower one and on into a reservoir;
    the upper tank can overflow, partly into the lower one. The level sensor clips at 10 V.
    Channels: pump voltage [V] -> level of the lower tank, as sensor voltage [V].
    Samples: 1024 to train on, of which the last quarter validates, and 1024 to test on, every 4 s; n_init
    50.
    Source: M. Schoukens, P. Mattsson, T. Wigren, J.P. Noel, Cascaded tanks benchmark combining soft and
    hard nonlinearities, Workshop on Nonlinear System Identification Benchmarks, Brussels, 2016.
    Licence: not stated in the files.
    """
    train, test = _official("Cascaded_Tanks", folder)
    channels = _channels(Channel("pump", "V"), Channel("level", "V", "level"))
    return _dataset("cascaded_tanks", _named(["train"], train), _named(["test"], test), channels)


@DATASETS.register("ced")
@reads(
    "nonlinear_benchmarks",
    "CED/FULLTEXT01.zip",
    "CED/DATAUNIF.MAT",
    download=partial(_download, "CED"),
    where=f"{SITE}/benchmarks/coupled-electric-drives",
)
def ced(folder: Path) -> Dataset:
    """Coupled electric drives: two motors and a spring-held pulley on one flexible belt

    Machine: the belt's speed is measured by a pulse counter that does not see the sign of the velocity; the
    pulley and its spring make a lightly damped resonance.
    Channels: drive voltage, the same for both motors [V] -> speed of the belt [ticks/s].
    Samples: two records of 500, one of low and one of high amplitude, every 0.02 s; of each the first 400
    are to train on, their last quarter to validate on, and the last 100 to test on; n_init 10.
    Source: T. Wigren and M. Schoukens, Coupled electric drives data set and reference models, Technical
    report 2017-024, Department of Information Technology, Uppsala University, 2017.
    Licence: not stated in the files.
    """
    train, test = _official("CED", folder)
    channels = _channels(Channel("drive", "V"), Channel("speed", "ticks/s", "velocity"))
    names = ["low_amplitude", "high_amplitude"]
    heads = _named([f"train_{name}" for name in names], train)
    return _dataset("ced", heads, _named(names, test), channels)


@DATASETS.register("silverbox")
@reads(
    "nonlinear_benchmarks",
    "Silverbox/SilverboxFiles.zip",
    "Silverbox/SilverboxFiles/SNLS80mV.mat",
    download=partial(_download, "Silverbox"),
    where=f"{SITE}/benchmarks/silverbox",
)
def silverbox(folder: Path) -> Dataset:
    """Silverbox: an electronic mass on a hardening spring

    Machine: a circuit that obeys the Duffing equation; its output voltage stands for the position of the
    mass.
    Channels: input voltage, standing for a force [V] -> output voltage, standing for a position [V].
    Samples: multisine, 65062 to train on, of which the last quarter validates; tests multisine 21688,
    arrow_full 40475 (noise of growing amplitude, beyond the training data at its end),
    arrow_no_extrapolation, its first 32000, which pooled figures count twice; every 1/610.35 s; n_init 50.
    Source: T. Wigren and J. Schoukens, Three free data sets for development and benchmarking in nonlinear
    system identification, European Control Conference, pp. 2933-2938, Zurich, 2013.
    Licence: not stated in the files.
    """
    train, test = _official("Silverbox", folder)
    channels = _channels(Channel("u", "V"), Channel("y", "V", "position"))
    test_names = ["multisine", "arrow_full", "arrow_no_extrapolation"]
    return _dataset("silverbox", _named(["train_multisine"], train), _named(test_names, test), channels)


@DATASETS.register("wiener_hammerstein")
@reads(
    "nonlinear_benchmarks",
    "WienerHammerBenchMark/WienerHammerBenchMark.mat",
    download=partial(_download, "WienerHammerBenchMark"),
    where=f"{SITE}/benchmarks/wiener-hammerstein",
)
def wiener_hammerstein(folder: Path) -> Dataset:
    """Wiener-Hammerstein circuit: a diode saturation between two linear filters

    Machine: an electronic circuit of a third-order filter, a diode-resistor network and a third-order
    filter.
    Channels: input voltage [V] -> output voltage [V].
    Samples: 100000 to train on, of which the last quarter validates, and 78800 to test on, every 1/51200 s;
    n_init 50.
    Source: J. Schoukens, J. Suykens, L. Ljung, Wiener-Hammerstein benchmark, 15th IFAC Symposium on System
    Identification, Saint-Malo, 2009.
    Licence: not stated in the files.
    """
    train, test = _official("WienerHammerBenchMark", folder)
    channels = _channels(Channel("u", "V"), Channel("y", "V", "other"))
    return _dataset("wiener_hammerstein", _named(["train"], train), _named(["test"], test), channels)


@DATASETS.register("emps")
@reads(
    "nonlinear_benchmarks",
    "EMPS/EMPS.zip",
    "EMPS/DATA_EMPS.mat",
    "EMPS/DATA_EMPS_PULSES.mat",
    download=partial(_download, "EMPS"),
    where=f"{SITE}/benchmarks/emps",
)
def emps(folder: Path) -> Dataset:
    """EMPS: an electro-mechanical positioning system, a car on a ball screw, with dry friction

    Machine: a prismatic drive as in robots and machine tools. The plant integrates, so it was measured in
    closed loop; the drive saturates at 10 V. The test adds force pulses.
    Channels: motor voltage (`vir` of the file, whose other variable gtau makes it a force) [V] -> position
    [m]; published errors are mostly in mm.
    Samples: 24.8 s to train on, of which the last quarter validates, and as long to test on, every 1 ms;
    n_init 20.
    Source: A. Janot, M. Gautier, M. Brunot, Data set and reference models of EMPS, Workshop on Nonlinear
    System Identification Benchmarks, Eindhoven, 2019.
    Licence: not stated in the files.
    """
    train, test = _official("EMPS", folder)
    channels = _channels(Channel("motor", "V"), Channel("position", "m", "position"))
    return _dataset("emps", _named(["train"], train), _named(["pulses"], test), channels)


@DATASETS.register("f16")
@reads(
    "nonlinear_benchmarks",
    "F16/F16GVT_Files.zip",
    "F16/F16GVT_Files/BenchmarkData/*.mat",
    download=partial(_download, "F16"),
    where=f"{SITE}/benchmarks/f-16-gvt",
)
def f16(folder: Path) -> Dataset:
    """F-16 ground vibration test: a full-scale aircraft shaken at one wing

    Machine: a shaker under the right wing; the payload's rail-mounted interface has clearance and friction.
    Channels: shaker force [N] -> acceleration at the point of excitation [m/s^2], the package's default of
    three.
    Samples: 8 records to train on, of which the last quarters validate, and 6 of other levels to test on:
    multisines of 73728 and sine sweeps of 108477, every 1/400 s; n_init 50.
    Source: J.P. Noel and M. Schoukens, F-16 aircraft benchmark based on ground vibration test data,
    Workshop on Nonlinear System Identification Benchmarks, pp. 19-23, Brussels, 2017.
    Licence: not stated in the files.
    """
    train, test = _official("F16", folder)
    channels = _channels(Channel("force", "N"), Channel("acceleration", "m/s^2", "other"))
    train, test = ({Path(r.name).stem: r for r in records} for records in (train, test))
    return _dataset("f16", train, test, channels)
