"""Four measured sets of DaISy, the database for the identification of systems of KU Leuven.

B. De Moor (ed.), DaISy, Department of Electrical Engineering, ESAT/STADIUS, KU Leuven.
Each is one record, split in time 60/20/20.
"""

from __future__ import annotations

import gzip
import urllib.request
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.data.measured.locations import reads
from simgap.data.splits import assemble, split_in_time
from simgap.records import Channel, Channels, Dataset, Experiment
from simgap.registry import DATASETS

SITE = "https://homes.esat.kuleuven.be/~smc/daisy/daisydata.html"
FILES = "https://ftp.esat.kuleuven.be/pub/SISTA/data"
TIMEOUT = 60  # s
LARGEST = 64 << 20  # bytes of an unpacked file; a few kilobytes may unpack to gigabytes


def _download(address: str, stem: str, folder: Path) -> None:
    with urllib.request.urlopen(f"{FILES}/{address}.dat.gz", timeout=TIMEOUT) as answer:
        unpacked = gzip.GzipFile(fileobj=answer).read(LARGEST + 1)
    if len(unpacked) > LARGEST:
        raise ValueError(f"{stem} is larger than {LARGEST >> 20} MiB, which none of these sets is")
    (folder / f"{stem}.dat").write_bytes(unpacked)


def _columns(folder: Path, stem: str, count: int) -> Float[np.ndarray, "T columns"]:
    """Read the table in stem.mat, or in stem.dat as DaISy hands it out."""
    if (folder / f"{stem}.mat").is_file():
        from scipy.io import loadmat

        table = loadmat(folder / f"{stem}.mat")[stem]
    else:
        table = np.loadtxt(folder / f"{stem}.dat")
    if table.ndim != 2 or table.shape[1] != count:
        raise ValueError(f"{stem} has the shape {table.shape} where {count} columns are expected")
    return np.asarray(table, dtype=np.float64)


def _dataset(name: str, table: Float[np.ndarray, "T 2"], dt: float, u: Channel, y: Channel) -> Dataset:
    record = Experiment("record", table[:, :1], table[:, 1:], dt)
    return assemble(name, split_in_time(record), Channels((u,), (y,)), None, name)


@DATASETS.register("daisy_hairdryer")
@reads(
    "daisy",
    "hairdryer.[dm]at",
    download=partial(_download, "mechanical/dryer", "hairdryer"),
    where=SITE,
)
def daisy_hairdryer(folder: Path) -> Dataset:
    """Hair dryer: air fanned through a tube and heated at its inlet

    Machine: laboratory set-up (Feedback's Process Trainer PT326); near linear, with a transport delay.
    Channels: voltage over the heating wires [V] -> air temperature, as thermocouple voltage [V].
    Samples: 1000, every 0.08 s. DaISy does not give the sampling time; it is that of the same record in L.
    Ljung's System Identification Toolbox (dryer2).
    Source: L. Ljung, System identification: theory for the user, Prentice Hall, 1987; DaISy, contributed by
    W. Favoreel.
    Licence: not stated.
    """
    table = _columns(folder, "hairdryer", 2)
    y = Channel("temperature", "V", "other")
    return _dataset("daisy_hairdryer", table, 0.08, Channel("heater", "V"), y)


@DATASETS.register("daisy_robot_arm")
@reads(
    "daisy",
    "robotArm.[dm]at",
    download=partial(_download, "mechanical/robot_arm", "robotArm"),
    where=SITE,
)
def daisy_robot_arm(folder: Path) -> Dataset:
    """Flexible robot arm on an electrical motor

    Machine: a flexible arm, excited by a periodic sine sweep.
    Channels: reaction torque of the structure on the ground [unit not given] -> acceleration of the arm
    [not given].
    Samples: 1024. The sampling time is not published: dt = 1 s stands for "one sample", so times and
    frequencies of this set count samples.
    Source: H. Van Brussel and J. Swevers, KU Leuven; DaISy, contributed by W. Favoreel.
    Licence: not stated.
    """
    table = _columns(folder, "robotArm", 2)
    return _dataset("daisy_robot_arm", table, 1.0, Channel("torque"), Channel("acceleration", kind="other"))


@DATASETS.register("daisy_exchanger")
@reads(
    "daisy",
    "exchanger.[dm]at",
    download=partial(_download, "process_industry/exchanger", "exchanger"),
    where=SITE,
)
def daisy_exchanger(folder: Path) -> Dataset:
    """Heat exchanger: water heated by saturated steam in a copper tube

    Machine: steam and inlet temperature are held constant; gain and time constant depend on the flow, and
    the response is of non-minimum phase.
    Channels: liquid flow rate [unit not given] -> outlet temperature of the liquid [not given]. The first
    column of the file is the sample number and is left out.
    Samples: 4000, every 1 s.
    Source: S. Bittanti and L. Piroddi, Nonlinear identification and control of a heat exchanger: a neural
    network approach, Journal of the Franklin Institute, 1996; DaISy, contributed by S. Bittanti.
    Licence: not stated.
    """
    table = _columns(folder, "exchanger", 3)[:, 1:]
    return _dataset("daisy_exchanger", table, 1.0, Channel("flow"), Channel("temperature", kind="other"))


@DATASETS.register("daisy_ballbeam")
@reads(
    "daisy",
    "ballbeam.[dm]at",
    download=partial(_download, "mechanical/ballbeam", "ballbeam"),
    where=SITE,
)
def daisy_ballbeam(folder: Path) -> Dataset:
    """Ball and beam: a ball rolling on a beam that tilts

    Machine: practicum set-up of ESAT-SISTA; the plant integrates twice, with gravity and friction.
    Channels: angle of the beam [unit not given] -> position of the ball [not given].
    Samples: 1000, every 0.1 s.
    Source: P. Van Overschee, Subspace identification: theory, implementation, application, PhD thesis, KU
    Leuven, 1995, pp. 200-206; DaISy, contributed by the same.
    Licence: not stated.
    """
    table = _columns(folder, "ballbeam", 2)
    return _dataset("daisy_ballbeam", table, 0.1, Channel("angle"), Channel("position", "", "position"))
