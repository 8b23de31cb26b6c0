"""Octave's arx and random ARMAX systems: what several tests of estimators compare with."""

import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.signal import lfilter

from simgap.records import Experiment, TrainingSet

OCTAVE = """
pkg load control
load ('systems.mat');
theta = cell (1, numel (systems));
for k = 1 : numel (systems)
  s = systems{k};
  delay = s.nk - 1;  % what arx counts beyond the one sample that every B(q) has
  sys = arx (iddata (s.y, s.u, s.dt), 'na', s.na, 'nb', s.nb, 'nk', delay);
  [num, den] = tfdata (sys);
  for i = 1 : columns (s.y{1})
    n = numel (den{i,1});
    row = den{i,1}(2 : s.na(i)+1)(:);
    for j = 1 : columns (s.u{1})
      b = [zeros(1, n - numel (num{i,j})), num{i,j}];  % tfdata drops leading zeros
      row = [row; b(s.nk+1 : s.nk+s.nb(i,j))(:)];
    end
    theta{k}{i} = row;
  end
end
save ('-v6', 'theta.mat', 'theta');
"""


@dataclass(frozen=True, eq=False)
class ArxProblem:
    """Experiments and orders: na [ny] of an output's own past, nb [ny, nu], one nk from 1."""

    experiments: tuple[Experiment, ...]
    na: Sequence[int]
    nb: Sequence[Sequence[int]]
    nk: int


@pytest.fixture(scope="session")
def arx_in_octave(tmp_path_factory) -> Callable[[Sequence[ArxProblem]], list[list[np.ndarray]]]:
    """A function from problems to theta = (a.., b..) of each output, by Octave's arx in one process."""
    octave = shutil.which("octave-cli") or shutil.which("octave")
    if octave is None:
        pytest.skip("Octave is not installed: apt-get install octave octave-control")
    folder = tmp_path_factory.mktemp("octave")

    def solve(problems: Sequence[ArxProblem]) -> list[list[np.ndarray]]:
        savemat(folder / "systems.mat", {"systems": _cells([_as_struct(p) for p in problems])})
        (folder / "solve.m").write_text(OCTAVE)
        done = subprocess.run(
            [octave, "--norc", "--quiet", "solve.m"], cwd=folder, capture_output=True, text=True, check=False
        )
        if "control" in done.stderr and not (folder / "theta.mat").exists():
            pytest.skip("Octave has no control package: apt-get install octave-control")
        assert (folder / "theta.mat").exists(), done.stderr
        return [[row.ravel() for row in rows.ravel()] for rows in loadmat(folder / "theta.mat")["theta"].ravel()]

    return solve


@pytest.fixture(scope="session")
def arx_problem() -> type[ArxProblem]:
    return ArxProblem


def _as_struct(problem: ArxProblem) -> dict[str, object]:
    experiments = problem.experiments
    return {
        "y": _cells([e.y for e in experiments]),
        "u": _cells([e.u for e in experiments]),
        "na": np.array(problem.na, float).reshape(-1, 1),
        "nb": np.array(problem.nb, float),
        "nk": float(problem.nk),
        "dt": experiments[0].dt,
    }


def _cells(values: Sequence[object]) -> np.ndarray:
    """An Octave cell column, which scipy writes from an array of objects."""
    cells = np.empty((len(values), 1), dtype=object)
    cells[:, 0] = [None] * len(values)
    for k, value in enumerate(values):
        cells[k, 0] = value
    return cells


@dataclass(frozen=True, eq=False)
class ArmaxRecord:
    """u, y [T] of A y = B u + C e in the midst of a long run, and the true theta = (a.., b.., c..).

    `information` is sum psi psi' / variance of e, with psi the slope of the true prediction (Ljung 1999, eq. 9.12).
    """

    na: int
    nb: int
    nc: int
    u: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    information: np.ndarray

    @property
    def training_set(self) -> TrainingSet:
        return TrainingSet((Experiment("e", self.u[:, None], self.y[:, None], 1.0),), (), 10)

    def polynomials(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B (from lag 0, which is zero) and C of some theta."""
        a, b, c = np.split(theta, [self.na, self.na + self.nb])
        return np.r_[1.0, a], np.r_[0.0, b], np.r_[1.0, c]

    def cost_from_zero(self, theta: np.ndarray, skip: int = 0) -> float:
        """sum e^2 with e = 0 before the first sample whose past is all measured, less the first `skip` of them."""
        e = self._errors(theta, max(self.na, self.nb, self.nc))[skip:]
        return float(e @ e) if np.isfinite(e).all() else np.inf

    def cost(self, theta: np.ndarray) -> float:
        """sum e^2 with those e before the record, counted too, that make the sum smallest."""
        c = self.polynomials(theta)[2]
        e = self._errors(theta, max(self.na, self.nb))
        impulse = np.eye(1, len(e))[0]
        with np.errstate(all="ignore"):
            echo = np.stack([lfilter(-c[k:], c, impulse) for k in range(1, len(c))], axis=1)  # of e(-k) = 1
        if not (np.isfinite(e).all() and np.isfinite(echo).all()):
            return np.inf
        free, target = np.vstack((echo, np.eye(self.nc))), np.r_[e, np.zeros(self.nc)]
        best = target - free @ np.linalg.lstsq(free, target, rcond=None)[0]
        return float(best @ best)

    def _errors(self, theta: np.ndarray, first: int) -> np.ndarray:
        a, b, c = self.polynomials(theta)
        with np.errstate(all="ignore"):
            return lfilter([1.0], c, (lfilter(a, 1.0, self.y) - lfilter(b, 1.0, self.u))[first:])


@pytest.fixture(scope="session")
def random_armax() -> Callable[[int], ArmaxRecord]:
    return _random_armax


def _random_armax(seed: int) -> ArmaxRecord:
    """Orders 1 to 4, 300 to 3,000 samples, noise from 3 to 100 % of the signal, three sorts of input."""
    rng = np.random.default_rng(seed)
    na, nb, nc = (int(order) for order in rng.integers(1, 5, 3))
    samples = int(rng.integers(300, 3001))
    a, c = _stable(rng, na, 0.2, 0.95), _stable(rng, nc, 0.1, 0.9)
    b = np.r_[0.0, rng.normal(size=nb)]
    unseen, level = 500, (0.03, 0.1, 0.3, 1.0)[seed % 4]
    hold = int(rng.integers(1, 6)) if seed % 3 == 2 else 1
    length = unseen + samples
    u = rng.normal(size=length) if seed % 3 == 0 else np.repeat(rng.choice([-1.0, 1.0], size=length), hold)[:length]
    e = rng.normal(size=length)
    signal, noise = lfilter(b, a, u), lfilter(c, a, e)
    sigma = level * signal.std() / noise.std()
    y = signal + sigma * noise
    theta = np.r_[a[1:], b[1:], c[1:]]
    slopes = []
    for past, lags in ((-y, na), (u, nb), (sigma * e, nc)):
        filtered = lfilter([1.0], c, past)
        slopes += [filtered[unseen - k : length - k] for k in range(1, lags + 1)]
    psi = np.array(slopes) / sigma
    return ArmaxRecord(na, nb, nc, u[unseen:], y[unseen:], theta, psi @ psi.T)


def _stable(rng: np.random.Generator, order: int, smallest: float, largest: float) -> np.ndarray:
    """A monic polynomial with real and complex roots of a size between the two."""
    roots: list[complex] = []
    while len(roots) < order:
        radius = rng.uniform(smallest, largest)
        if order - len(roots) >= 2 and rng.random() < 0.6:
            angle = rng.uniform(0.1, np.pi - 0.1)
            roots += [radius * np.exp(1j * angle), radius * np.exp(-1j * angle)]
        else:
            roots.append(radius * rng.choice([-1, 1], p=[0.3, 0.7]))
    return np.real(np.poly(roots))
