"""Signals and parameters on which effects are tried without a fit."""

import numpy as np

from simgap.greybox.effects.scales import SignalScales


def scales(kind="position", order=2):
    return SignalScales(
        kind=kind, order=order, dt=0.1, duration=12.0, u_low=-2.0, u_high=2.0, u_rms=1.0,
        y_low=0.1 if kind == "level" else -3.0, y_high=3.0, y_rms=1.0, x_max=3.0, v_max=4.0, stroke=3.0, force_rms=5.0,
        u_unit="V", y_unit="rad", lines=(0.5,), tones=(0.5,), quantisation_step=0.1,
    )  # fmt: skip


def values_of(effect, seen):
    """A few sets of parameters: where fits begin, and one near the other bounds."""
    parameters = effect.parameters(seen)
    # An amplitude is estimated; here a value inside its bounds.
    starts = [list(start.values) for start in effect.starts(seen)]
    middle = [p.low if p.fixed else p.low + 0.3 * (p.high - p.low) for p in parameters]
    return [np.array(values, dtype=float) for values in [*starts, middle]]


def signal(seed, length=120):
    rng = np.random.default_rng(seed)
    smooth = np.cumsum(rng.normal(size=length)) * 0.3
    return smooth + np.repeat(rng.choice([-1.5, 0.0, 1.5], size=length // 10), 10)
