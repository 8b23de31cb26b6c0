"""Our calls and a peer's, in turns, so that a noisy machine hits both; and the table of ratios at the end."""

import contextlib
import io
import shutil
import statistics
import subprocess
import warnings
from collections.abc import Callable, Iterator
from time import perf_counter

import numpy as np
import pytest
from scipy.io import savemat
from scipy.signal import lfilter

from simgap.baselines.arx import Arx
from simgap.records import Experiment, TrainingSet

ROWS: list[str] = []
NOTES: list[str] = []


@pytest.fixture(scope="session", autouse=True)
def unchecked_functions() -> None:
    if hasattr(Arx.fit, "__wrapped__"):
        pytest.fail("the checks of shapes and types are on and would be timed along: add --confcutdir=tests/speed")


@pytest.fixture(scope="session")
def record() -> Callable[..., TrainingSet]:
    """A function from a number of samples to one experiment of a second-order plant, with coloured noise on demand."""

    def draw(samples: int, c: tuple[float, ...] = (1.0,)) -> TrainingSet:
        rng = np.random.default_rng(samples)
        u, e = rng.standard_normal((2, samples))
        y = lfilter([0.0, 1.0, 0.5], [1.0, -1.5, 0.7], u) + lfilter(c, [1.0, -1.5, 0.7], 0.1 * e)
        return TrainingSet((Experiment("e", u[:, None], y[:, None], 1.0),), (), 10)

    return draw


@pytest.fixture
def compare(benchmark) -> Callable[..., None]:
    """Time `ours` and `peer` in turns and hold the ratio of the medians against the limit."""

    def run(task: str, name: str, ours: Callable, peer: Callable[[], float], rounds: int, limit: int | None = None):
        seconds: list[float] = []

        def peer_first() -> None:
            seconds.append(peer())
            # A peer's call is long enough to warm the processor up; ours takes a millisecond, and starts where the
            # wait for the peer has left it: asleep, with the peer's data in the cache.
            for _ in range(5):
                ours()

        peer()
        benchmark.pedantic(ours, setup=peer_first, rounds=rounds)
        mine, other = benchmark.stats["median"], statistics.median(seconds)
        ratio = other / mine
        benchmark.extra_info.update(task=task, peer=name, peer_median=other, ratio=ratio, limit=limit)
        _add_row(task, mine, name, other, limit)
        assert limit is None or ratio >= limit, f"{task}: {ratio:.0f} times {name}, the limit is {limit}"

    return run


def _add_row(task: str, mine: float, name: str, other: float, limit: int | None) -> None:
    goal = "" if limit is None else f"{limit}"
    ROWS.append(f"| {task} | {1e3 * mine:.3g} | {name} | {1e3 * other:.4g} | {other / mine:.3g} | {goal} |")


@pytest.fixture(scope="session")
def row() -> Callable[..., None]:
    """Adds a line to the table: task, our seconds, peer, its seconds, limit of the ratio."""
    return _add_row


@pytest.fixture(scope="session")
def note() -> Callable[[str], None]:
    """Adds a line below the table."""
    return NOTES.append


@pytest.fixture(scope="session")
def timed() -> Callable[..., float]:
    """Seconds of one call of a peer, silenced."""

    def call(function: Callable, *arguments, **named) -> float:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            start = perf_counter()
            function(*arguments, **named)
            return perf_counter() - start

    return call


@pytest.fixture(scope="session")
def sippy():
    return _peer("sippy_unipi", "SIPPY").system_identification


@pytest.fixture(scope="session")
def sysidentpy():
    """A function that makes SysIdentPy's linear NARX model with two past outputs and inputs."""
    _peer("sysidentpy", "SysIdentPy")
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    return lambda: FROLS(
        order_selection=False, n_terms=4, ylag=2, xlag=2, basis_function=Polynomial(degree=1), estimator=LeastSquares()
    )


def _peer(module: str, name: str):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(module, reason=f"{name} is not installed: make peers")


@pytest.fixture(scope="session")
def octave(tmp_path_factory) -> Iterator["Octave"]:
    program = shutil.which("octave-cli")
    if program is None:
        pytest.skip("Octave is not installed: apt-get install octave octave-control")
    session = Octave(program, tmp_path_factory.mktemp("octave"))
    if not session.ask("try, pkg load control, disp (1), catch, disp (0), end"):
        pytest.skip("Octave has no control package: apt-get install octave-control")
    yield session
    session.close()


class Octave:
    """One running Octave that answers every line with a number."""

    def __init__(self, program: str, folder):
        self.folder = folder
        self.process = subprocess.Popen(
            [program, "--norc", "--quiet"],
            cwd=folder,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )

    def ask(self, line: str) -> float:
        self.process.stdin.write(f"{line}; fflush (stdout);\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def load(self, data: TrainingSet) -> None:
        """Make `dat`, an iddata set of the training record."""
        savemat(self.folder / "data.mat", {"y": data.train[0].y, "u": data.train[0].u})
        self.ask("load ('data.mat'); dat = iddata (y, u, 1); disp (1)")

    def close(self) -> None:
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()


def pytest_terminal_summary(terminalreporter) -> None:
    head = ["| task | ours, ms | peer | peer, ms | ratio | at least |", "|---|---|---|---|---|---|"]
    terminalreporter.write_line("\n".join(["", *(head if ROWS else []), *ROWS, "", *NOTES]))
