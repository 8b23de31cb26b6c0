"""A force that is a sine of time."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, ForceEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS

REPEATS = 2  # periods within a record, at least: any slow noise looks like a part of a sine


class _Sine(ForceEffect):
    """A disturbance of one frequency, whatever is known of its phase."""

    name: ClassVar[str] = "periodic_disturbance"
    title: ClassVar[str] = "a periodic disturbance"
    explanation: ClassVar[str] = (
        "A force of one frequency that has nothing to do with the input: an unbalanced rotor nearby, mains hum, the "
        "pulsation of a pump. Whether it shakes the machine or only its reading, one frequency does not tell."
    )
    reference: ClassVar[str] = (
        "Bodson and Douglas, Adaptive algorithms for the rejection of sinusoidal disturbances, Automatica 33, 1997"
    )
    shows_in: ClassVar[tuple[ViewName, ...]] = ("frequency band", "time since the start")
    confounders: ClassVar[dict[str, str]] = {
        "position_torque": (
            "move at another speed: a disturbance in time keeps its frequency, a force over position does not"
        ),
        "sensor_drift": "record for longer: a disturbance repeats itself, a drift goes on growing",
        "actuator_lag": "record without any input: a disturbance goes on, a lag has nothing to act on",
        "sensor_lag": "record without any input: a disturbance goes on, a lag has nothing to act on",
        "input_delay": "record without any input: a disturbance goes on, a delay has nothing to act on",
    }


def _amplitude_and_frequency(scales: SignalScales) -> tuple[Parameter, Parameter]:
    most = 20 * scales.force_rms
    return (
        Parameter("amplitude", scales.force_unit, -most, most),
        Parameter("frequency", "Hz", REPEATS / scales.duration, 0.5 / scales.dt),
    )


@final
class AnyPhase(_Sine):
    """f = a cos(2 pi f t) + b sin(2 pi f t), with other a and b in every experiment: none begins in step with it."""

    own: ClassVar[int] = 2
    common: ClassVar[int] = 1
    per_experiment: ClassVar[bool] = True
    repeats: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the amplitude and the frequency."""
        return _amplitude_and_frequency(scales)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from the frequencies that stand out in the errors, whatever their phase."""
        return [Start((0.1 * scales.force_rms, f)) for f in scales.tones if f * scales.duration >= REPEATS]

    @staticmethod
    def shapes(t: np.ndarray, duration: float, common: np.ndarray) -> np.ndarray:
        """Return cosine and sine."""
        angle = 2 * math.pi * common[0] * t
        return np.stack((np.cos(angle), np.sin(angle)))


@EFFECTS.register("periodic_disturbance")
@final
class PeriodicDisturbance(_Sine):
    """f = A sin(2 pi f t + phase), t since the machine began to run."""

    of_each: ClassVar[type[Effect] | None] = AnyPhase

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the amplitude, the frequency, and the phase at the start of a run."""
        return (*_amplitude_and_frequency(scales), Parameter("phase", "rad", -20.0, 20.0))

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from the lines that the error spectra of all experiments share, each with two phases."""
        return [
            Start((0.1 * scales.force_rms, frequency, phase), amplitude=0)
            for frequency in scales.lines
            if frequency * scales.duration >= REPEATS
            for phase in (0.0, 1.57)
        ]

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return A sin(2 pi f t + phase)."""
        return p[i] * math.sin(6.283185307179586 * p[i + 1] * t + p[i + 2])
