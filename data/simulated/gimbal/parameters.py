"""The gimbal itself: every physical constant, and every effect that can be switched on."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

Pair = tuple[float, float]  # one number for phi, one for phi_dot


@dataclass(frozen=True)
class Gimbal:
    """A voltage-driven motor that turns a body about the yaw axis, and the sensors on it.

    Whatever is 0 (a limit: infinite) is off. Changing one field changes neither inputs nor noise draws.
    The constants are those of no particular robot: they were chosen so that the recordings have the spread of
    the authors' (about 65 deg/s and 90 deg) and the 10 Hz input is just within the bandwidth (paper, 2.4).
    """

    # Motor and body.
    yaw_inertia: float = 0.035  # kg m^2
    motor_inertia: float = 0.0007  # kg m^2, at the motor's own shaft
    gear: float = 3.0  # turns of the motor to one of the body
    torque_constant: float = 0.6  # N m/A, which is also the back-EMF in V s/rad
    resistance: float = 8.0  # Ohm
    viscous: float = 0.11  # N m s/rad
    coulomb: float = 0.15  # N m, moving and sticking; about 0.7 V at the motor
    cable_stiffness: float = 0.025  # N m/rad
    position_torque: float = 0.05  # N m, sine over position: the pull of the cable to one side
    position_period: float = 360.0  # deg
    position_phase: float = 0.0  # rad
    # Between the voltage asked for and the voltage at the motor.
    voltage_limit: float = 8.0  # V
    dead_zone: float = 0.0  # V, each way
    asymmetric_gain: float = 0.0  # share: positive voltage counts 1 + a, negative 1 - a
    backlash: float = 0.0  # V, whole gap
    input_delay: float = 0.0  # s, rounded to the step of the integration
    actuator_lag: float = 0.0  # s
    gain_fade: float = 0.0  # share of the gain that is lost, linearly, by the end of an experiment
    # Torques that are off by default.
    constant_load: float = 0.0  # N m
    stribeck: float = 0.0  # N m on top of coulomb at standstill
    stribeck_velocity: float = 10.0  # deg/s
    quadratic_drag: float = 0.0  # N m s^2/rad^2
    quadratic_stiffness: float = 0.0  # N m/rad^2
    cubic_stiffness: float = 0.0  # N m/rad^3
    periodic_disturbance: float = 0.0  # N m
    periodic_frequency: float = 0.3  # Hz
    hysteresis: float = 0.0  # N m at saturation
    hysteresis_width: float = 20.0  # deg that the body turns until then
    # Sensors, (phi, phi_dot) in deg and deg/s.
    noise: Pair = (0.05, 1.5)  # standard deviation
    noise_colour: float = 0.0  # correlation of two noise samples 0.1 s apart; 0 is white
    drift: Pair = (1.0, 0.25)  # per second; standard deviation over experiments of the slope
    bias: Pair = (0.0, 0.0)  # standard deviation over experiments
    sensor_lag: Pair = (0.0, 0.0)  # s
    sensor_limit: Pair = (inf, inf)
    absolute_sensor: tuple[bool, bool] = (False, False)
    quantisation: Pair = (360 / 4096, 0.0)  # the encoder has 4096 counts per turn
    outlier_rate: float = 0.0  # share of the samples, in each channel
    outlier_size: Pair = (50.0, 200.0)
    # Between the sessions of the protocol: dry and viscous friction times this.
    session_friction: tuple[float, float, float] = (1.0, 0.94, 1.05)

    @classmethod
    def linear(cls, **changes: Any) -> Gimbal:
        """Make a gimbal with everything off that a linear model of order 2 and white noise do not cover."""
        off = {
            "coulomb": 0.0,
            "position_torque": 0.0,
            "drift": (0.0, 0.0),
            "quantisation": (0.0, 0.0),
            "session_friction": (1.0, 1.0, 1.0),
        }
        return cls(**(off | changes))

    @classmethod
    def of_gm6020(cls) -> Gimbal:
        """Make the yaw axis of a robot that a GM6020 motor turns without a gear; what nobody measured is as usual.

        Inertia and damping as identified by others, dry friction in the middle of their 0.1 to 0.3 N m
        (LYHrmer/gimbal-lqr-eso); torque per current and 8192 counts from the maker. Were all damping back-EMF, the
        winding would have k^2 / damping = 2.27 Ohm and an idle motor at 24 V 309 rpm; the resistance is that.
        """
        k, damping = 0.741, 0.242
        return cls(
            yaw_inertia=0.0343, motor_inertia=0.0, gear=1.0, torque_constant=k, resistance=k**2 / damping, viscous=0.0,
            coulomb=0.2, quantisation=(360 / 8192, 0.0),
        )  # fmt: skip

    @property
    def inertia(self) -> float:
        """kg m^2 at the yaw axis."""
        return self.yaw_inertia + self.gear**2 * self.motor_inertia

    @property
    def torque_per_volt(self) -> float:
        """N m/V at the yaw axis."""
        return self.gear * self.torque_constant / self.resistance

    @property
    def damping(self) -> float:
        """N m s/rad: viscous friction and back-EMF."""
        return self.viscous + self.torque_per_volt * self.gear * self.torque_constant
