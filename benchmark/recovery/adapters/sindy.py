"""pysindy at its best: smoothed derivatives or the weak form, a library with our laws, a free run that decides."""

from __future__ import annotations

import warnings

import numpy as np

from simgap.records import Dataset
from simgap.recovery.adapters.sindy_library import LINEAR, StateLibrary
from simgap.recovery.adapters.sindy_motion import Motion, free_run_errors, motions_of
from simgap.registry import ADAPTERS

WINDOWS = (5, 11, 21)  # samples, of the smoother and half of a test function
MIDDLE = 11
THRESHOLDS = (0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5)  # of columns and target at rms 1
RIDGE = 4e-7  # on squares that sum up to 1
LAGS = ["actuator_lag", "sensor_lag"]  # which no linear plant tells apart
WORSE = 1.05  # a shorter equation may err as much more in its free run over held-out records


@ADAPTERS.register("sindy")
def answer(dataset: Dataset) -> dict[str, list[list[str]]]:
    """Name the terms of the shortest equation that runs free nearly as well as the best.

    z' = Theta(z, u) xi by STLSQ (Brunton, Proctor and Kutz 2016), from derivatives or in the weak form (Messenger and
    Bortz 2021); z is x and v of a body, the level of a process and, as a second try, its rate. What sensors do,
    hysteresis and a controller inside are no columns of an equation of motion and cannot be named.
    """
    tried = []
    for second in (True,) if dataset.channels.outputs[0].kind in ("position", "velocity") else (False, True):
        train, valid = (motions_of(dataset, split, WINDOWS, second) for split in ("train", "valid"))
        library = _library(dataset, train[MIDDLE])
        equations = [xi for window in WINDOWS for weak in (False, True)
                     for xi in _equations(library, train[window], window, weak)]  # fmt: skip
        errors = free_run_errors(library, valid[MIDDLE], np.array(equations), second, dataset.n_init)
        tried += [(error, xi, library, train[MIDDLE]) for error, xi in zip(errors, equations, strict=True)]
    best = min(error for error, *_ in tried)
    named = [(*_names(library, train, xi), error) for error, xi, library, train in tried if error <= WORSE * best]
    names = min(named, key=lambda one: (len(one[0]), *one[1:]))[0]
    return {"names": [LAGS if name in LAGS else [name] for name in names]}


def _library(dataset: Dataset, motions: list[Motion]) -> StateLibrary:
    """The library for the sizes of these records."""
    output = dataset.channels.outputs[0]
    x, v = (np.concatenate([getattr(m, name) for m in motions]) for name in ("x", "v"))
    low, high = (float(end) for end in np.quantile(x, (0.005, 0.995)))
    body, has_x = output.kind in ("position", "velocity"), output.kind != "velocity"
    sizes = (float(np.std(x)) or 1.0, float(np.std(v)) or 1.0)
    return StateLibrary(body, output.unit == "rad", has_x, *sizes, low, high, _frequency(motions))


def _frequency(motions: list[Motion]) -> float:
    """The frequency of a disturbance in rad/s: the peak of what a linear equation leaves of the derivative."""
    left = []
    for m in motions:
        phi = np.column_stack((np.ones(len(m.x)), m.x, m.v, m.u))
        left.append(m.rate - phi @ np.linalg.lstsq(phi, m.rate, rcond=None)[0])
    size = 8 * min(map(len, left))
    power = sum(np.abs(np.fft.rfft(one, size)) ** 2 for one in left)
    peak = int(np.argmax(np.where(np.arange(size // 2 + 1) < 16, 0.0, power)))
    return float(2 * np.pi * peak / (size * motions[0].dt))


def _rows(library: StateLibrary, motions: list[Motion], window: int, weak: bool) -> tuple[np.ndarray, np.ndarray]:
    """Theta and the derivative of all records over the root of their number, as triangles of the same least squares."""
    parts = [np.column_stack(m.rows(library, window, weak)) for m in motions]
    triangle: np.ndarray = np.linalg.qr(np.concatenate(parts) / np.sqrt(sum(map(len, parts))), mode="r")  # type: ignore[assignment]
    return triangle[:, :-1], triangle[:, -1]


def _equations(library: StateLibrary, motions: list[Motion], window: int, weak: bool) -> list[np.ndarray]:
    """The coefficients of the linear equation, and of the library at every threshold."""
    from pysindy.optimizers import STLSQ

    phi, target = _rows(library, motions, window, weak)
    size, scale = np.linalg.norm(phi, axis=0), float(np.linalg.norm(target)) or 1.0
    size[size < 1e-9 * size.max()] = np.inf  # such as a stop that is never reached
    linear = np.array([name == LINEAR for name in motions[0].names(library)])
    found = []
    for chosen, threshold in ((linear, 0.0), *((np.ones_like(linear), threshold) for threshold in THRESHOLDS)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer = STLSQ(threshold=threshold, alpha=RIDGE)
            optimizer.fit(phi[:, chosen] / size[chosen], target[:, None] / scale)
        xi = np.zeros(len(size))
        xi[chosen] = np.asarray(optimizer.coef_)[0] * scale / size[chosen]
        found.append(xi)
    return found


def _names(library: StateLibrary, motions: list[Motion], xi: np.ndarray) -> tuple[list[str], int]:
    """The effects in an equation, the first the one without which it fits the derivative worst, and all its terms."""
    names = np.array(motions[0].names(library))
    phi, target = _rows(library, motions, MIDDLE, True)

    def squares_without(name: str) -> float:
        kept = phi[:, (xi != 0) & (names != name)]
        rest = target - kept @ np.linalg.lstsq(kept, target, rcond=None)[0]
        return float(rest @ rest)

    inside = [name for name in dict.fromkeys(names[xi != 0]) if name != LINEAR]
    return [str(name) for name in sorted(inside, key=squares_without, reverse=True)], int(np.count_nonzero(xi))
