"""The rigs before anything is hidden in them."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.known_plant import Known, KnownPlant
from simgap.records import Channel, Channels


@dataclass(frozen=True)
class Rig:
    """A plant before anything is hidden in it. U is its unit of input, L of length or level, Y of its first output.

    With `outflow` 0 it is a body: x'' = gain u - damping x' - stiffness x, where a `loop`
    puts u - x in the place of u. Otherwise it is a tank, level' =
    gain u - outflow level, or two, of which the lower is measured.
    """

    name: str
    dt: float  # s
    input: Channel
    outputs: tuple[Channel, ...]
    gain: float  # L/s^2 per U; tanks: L/s per U
    amplitude: float  # U, the largest input; tanks: around an operating point of the same size
    reach: float  # Y, about the largest reading of the first output
    damping: float = 0.0  # 1/s
    stiffness: float = 0.0  # 1/s^2
    outflow: float = 0.0  # 1/s
    upper: float = 0.0  # 1/s, outflow of the upper tank, if there is one
    loop: float = 0.0  # 1: the input is the goal of a position controller inside, of gain 1 N m per unit, inertia 1
    start: tuple[float, float] = (0.0, 0.0)  # spread of the initial x and v in L and L/s; tanks: of the levels
    # What the effects need besides their strength.
    breakaway: float = 2.0  # Stribeck: friction at rest as a multiple of that at high speed
    stribeck_velocity: float = 1.0  # L/s
    period: float = 1.0  # L, of the force over position
    ripple_period: float = 1.0  # L, of the gain over position
    hysteresis_width: float = 1.0  # L
    push_width: float = 1.0  # L
    frequency: float = 1.0  # Hz, of the periodic disturbance
    outlier: float = 1.0  # Y
    n_train: int = 8
    n_valid: int = 4
    n_test: int = 4
    samples: int = 300

    @property
    def channels(self) -> Channels:
        """The columns of its recordings, and of a servo what is known of it."""
        one = Known(1.0, 1.0, 1.0)
        servo = KnownPlant(self.input.name, controlled=True, gain=one, inertia=one) if self.loop else None
        return Channels((self.input,), self.outputs, servo)

    @property
    def middle(self) -> tuple[float, float]:
        """Levels of the lower and the upper tank at the operating point, L; zero for a body."""
        flow = self.gain * self.amplitude if self.outflow else 0.0
        return (flow / self.outflow if flow else 0.0, flow / self.upper if flow and self.upper else 0.0)

    @property
    def largest_input(self) -> float:
        """U; a tank's input goes from zero to twice its operating point."""
        return 2 * self.amplitude if self.outflow else self.amplitude


VOLT, LEVEL = Channel("u", "V"), (Channel("level", "cm", "level"),)

RIGS = {
    rig.name: rig
    for rig in (
        Rig(
            "cart", 0.1, Channel("force", "N"), (Channel("v", "m/s", "velocity"),),
            gain=0.8, amplitude=4.0, reach=1.6, damping=1.6, start=(0.0, 0.4),
            stribeck_velocity=0.15, hysteresis_width=0.2, frequency=0.31, outlier=2.4,
        ),
        Rig(
            "stage", 0.05, VOLT, (Channel("x", "mm", "position"),),
            gain=50.0, amplitude=5.0, reach=10.0, damping=4.0, stiffness=25.0, start=(2.0, 10.0),
            stribeck_velocity=3.0, period=6.0, ripple_period=9.0, hysteresis_width=2.0, push_width=4.0,
            frequency=0.43, outlier=13.0,
        ),
        Rig(
            "slide", 0.1, VOLT, (Channel("x", "cm", "position"), Channel("v", "cm/s", "velocity")),
            gain=10.0, amplitude=5.0, reach=25.0, damping=2.4, stiffness=2.0, start=(4.0, 5.0),
            stribeck_velocity=3.0, period=10.0, ripple_period=20.0, hysteresis_width=3.0, push_width=8.0,
            frequency=0.23, outlier=30.0,
        ),
        Rig(
            "tank", 2.0, VOLT, LEVEL,
            gain=0.08, amplitude=4.0, reach=16.0, outflow=0.032, start=(2.0, 0.0), frequency=0.007, outlier=10.0,
        ),
        Rig(
            "tanks", 4.0, VOLT, LEVEL,
            gain=0.07, amplitude=4.0, reach=16.0, outflow=0.028, upper=0.04, start=(2.0, 1.5), frequency=0.0037,
            outlier=10.0,
        ),
        Rig(
            "arm", 0.02, Channel("torque", "N m"), (Channel("angle", "rad", "position"),),
            gain=8.0, amplitude=3.0, reach=2.5, damping=3.0, start=(0.4, 1.0), frequency=0.7, outlier=3.0,
        ),
        Rig(
            "servo", 0.01, Channel("goal", "rad"), (Channel("angle", "rad", "position"),),
            gain=300.0, amplitude=1.5, reach=1.5, damping=25.0, loop=1.0, start=(0.1, 0.3), frequency=0.7, outlier=2.0,
        ),
        Rig(
            "supply", 1e-4, Channel("control", "V"), (Channel("v", "V"),),
            gain=9e6, amplitude=5.0, reach=20.0, damping=1500.0, stiffness=2.25e6, start=(4.0, 4e3), frequency=250.0,
            outlier=26.0,
        ),
    )
}  # fmt: skip
