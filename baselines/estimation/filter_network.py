"""A network of filters and curves, trained on all of a long record at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.fft import next_fast_len

TAPS = 96  # samples that each filter reaches back
CURVES = 12
ROUNDS, STEPS = 80, 20  # of L-BFGS; the held-out error is asked for after each round
PATIENCE = 8  # rounds without a better one
HISTORY = 60  # steps that L-BFGS remembers
DECAY = 10.0  # samples: of the impulse responses that are drawn


@dataclass(frozen=True, eq=False)
class FilterNetwork:
    """e_hat = B(q) tanh(A(q) z + a) + L(q) z + c with finite impulse responses A, B, L; z are signals to their scale.

    Filters before and after curves without memory are parallel Wiener-Hammerstein models (Schoukens and Tiels,
    Automatica 85, 2017). share is the part of the held-out squared error that it predicts.
    """

    means: Float[np.ndarray, " s"]
    sizes: Float[np.ndarray, " s"]
    weights: tuple[np.ndarray, ...]  # A [curves, s, taps], a, B [1, curves, taps], L [1, s, taps], c
    size: float  # of the error
    largest: float  # error in training; no prediction is larger
    share: float

    def predict(self, u: Float[np.ndarray, "B T nu"], y_hat: Float[np.ndarray, "B T ny"]) -> Float[np.ndarray, "B T"]:
        """Predict the error of a simulation y_hat; before a record the signals stood still."""
        import torch

        z = (np.concatenate((u, y_hat), axis=2) - self.means) / self.sizes
        with torch.no_grad():
            e = _pass(torch.tensor(np.moveaxis(z, 2, 1).copy()), [torch.tensor(w) for w in self.weights])
        return np.clip(self.size * e[:, 0].numpy(), -self.largest, self.largest)

    @property
    def n_params(self) -> int:
        """Numbers that were trained."""
        return sum(w.size for w in self.weights)


def train(
    u: Float[np.ndarray, "E T nu"],
    y_hat: Float[np.ndarray, "E T ny"],
    e: Float[np.ndarray, "E T"],
    mask: Bool[np.ndarray, "E T"],
    held_out: Bool[np.ndarray, " E"],
    seed: int,
) -> FilterNetwork:
    """Minimise the mean squared error by L-BFGS (Liu and Nocedal 1989), and keep what is best on held-out records."""
    import torch

    z = np.concatenate((u, y_hat), axis=2)
    means, sizes, size = z[mask].mean(axis=0), z[mask].std(axis=0), float(np.std(e[mask])) or 1.0
    sizes = np.where(sizes > 0, sizes, 1.0)
    z = np.moveaxis((z - means) / sizes, 2, 1)
    parts = []
    for part in (~held_out, held_out):
        of_part = [torch.tensor(values[part], dtype=torch.float32) for values in (z, e[:, None] / size, mask[:, None])]
        parts.append(of_part)
    weights = [torch.tensor(w, dtype=torch.float32, requires_grad=True) for w in _drawn(z.shape[1], seed)]

    def mse(part: int) -> torch.Tensor:
        signals, errors, known = parts[part]
        return torch.sum(known * (_pass(signals, weights) - errors) ** 2) / known.sum()

    best, kept, since = float("inf"), [w.detach().clone() for w in weights], 0
    for _ in _rounds(weights, lambda: mse(0)):
        with torch.no_grad():
            now = float(mse(1))
        since = 0 if now < best else since + 1
        if now < best:
            best, kept = now, [w.detach().clone() for w in weights]
        if since == PATIENCE or not np.isfinite(now):
            break
    _, errors, known = parts[1]
    share = 1 - best / float(torch.sum(known * errors**2) / known.sum())
    largest = float(np.abs(e[mask]).max())
    return FilterNetwork(means, sizes, tuple(w.double().numpy() for w in kept), size, largest, share)


def _rounds(weights: list, loss) -> Iterator[None]:
    import torch

    optimizer = torch.optim.LBFGS(weights, max_iter=STEPS, history_size=HISTORY, line_search_fn="strong_wolfe")

    def closure() -> torch.Tensor:
        optimizer.zero_grad()
        value = loss()
        value.backward()
        return value

    for _ in range(ROUNDS):
        optimizer.step(closure)
        yield


def _drawn(signals: int, seed: int) -> list[np.ndarray]:
    """Draw impulse responses that decay."""
    rng, decay = np.random.default_rng(seed), np.exp(-np.arange(TAPS)[::-1] / DECAY)
    a, b, linear = (
        size * decay * rng.uniform(-1, 1, (*shape, TAPS)) / np.sqrt(shape[1] * DECAY)
        for size, shape in ((1.0, (CURVES, signals)), (0.03, (1, CURVES)), (0.03, (1, signals)))
    )
    return [a, rng.uniform(-1, 1, CURVES) / np.sqrt(signals * DECAY), b, linear, np.zeros(1)]


def _pass(z, weights):
    """Compute B(q) tanh(A(q) z + a) + L(q) z + c of signals z [E, s, T]."""
    a, offsets, b, linear, offset = weights
    return _filtered(_filtered(z, a).add(offsets[:, None]).tanh(), b) + _filtered(z, linear) + offset


def _filtered(x, taps):
    """Sum the signals x [E, s, T] through the impulse responses taps [o, s, taps], last sample first, by FFT."""
    import torch
    from torch.nn.functional import pad

    before = taps.shape[2] - 1
    n = next_fast_len(x.shape[2] + before, real=True)
    spectra = torch.fft.rfft(pad(x, (before, 0), mode="replicate"), n), torch.fft.rfft(taps, n).conj()
    return torch.fft.irfft(torch.einsum("esf,osf->eof", *spectra), n)[:, :, : x.shape[2]]
