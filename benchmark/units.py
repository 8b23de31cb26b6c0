"""Units as people write them: whether a text is a unit, what it measures, and what it is in SI."""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

# What one symbol measures; those of a single letter and those of SI prefixes are told apart by capitals.
DEGREE, TURN = math.pi / 180, 2 * math.pi
ANGLES = {
    "rad": 1.0, "deg": DEGREE, "degree": DEGREE, "degrees": DEGREE, "°": DEGREE, "rev": TURN, "revs": TURN,
    "turn": TURN, "turns": TURN, "arcmin": DEGREE / 60, "arcsec": DEGREE / 3600,
}  # fmt: skip  # in rad
LENGTHS = {"m": 1.0, "inch": 0.0254, "inches": 0.0254, "in": 0.0254, "ft": 0.3048}  # in m
TIMES = {
    "s": (1, 1), "sec": (1, 1), "secs": (1, 1), "second": (1, 1), "seconds": (1, 1),
    "ms": (1, 10**3), "msec": (1, 10**3), "milliseconds": (1, 10**3),
    "us": (1, 10**6), "usec": (1, 10**6), "microseconds": (1, 10**6), "ns": (1, 10**9), "nsec": (1, 10**9),
    "min": (60, 1), "minutes": (60, 1), "h": (3600, 1), "hr": (3600, 1), "hours": (3600, 1),
    "d": (86400, 1), "days": (86400, 1),
}  # fmt: skip  # seconds as a fraction, so that 10 ms is 0.01 s to the bit
OTHERS = {
    "V", "A", "W", "N", "Nm", "Pa", "bar", "J", "K", "C", "F", "Hz", "T", "g", "l", "L", "Ohm", "Ω", "H", "S", "mol",
    "VA", "Wh", "Ah", "degC", "degF", "degK", "psi", "lb", "lbf", "dB", "pH", "ppm", "%", "percent", "rh", "volt",
    "volts", "amp", "amps", "ampere", "newton", "celsius", "kelvin", "mmHg", "oz", "G",
}  # fmt: skip
LABELS = {"-", "1", "tick", "ticks", "count", "counts", "pulses", "steps", "lsb", "bit", "bits", "raw", "a.u.", "au"}
ROTATIONS = {"rpm", "r/min", "u/min", "rev/min"}
SPEEDS = {"kmh": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.44704}  # in m/s
PREFIXED = {"V", "A", "W", "N", "Nm", "Pa", "bar", "J", "K", "Hz", "T", "g", "l", "L", "Ohm", "Ω", "H", "F",
            "C", "mol", "VA", "Wh", "Ah"}  # fmt: skip
PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "h": 1e2, "d": 0.1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}
FACTOR = re.compile(r"([^\d\^\-+]*[^\d\^\-+.]|[-1](?!.))(?:\^?([-+]?\d))?")


@dataclass(frozen=True)
class Quantity:
    """What a unit measures, as exponents; `other` where anything but angle, length and time is in it."""

    angle: int = 0
    length: int = 0
    time: int = 0
    other: bool = False
    label: bool = False


@lru_cache(maxsize=1000)
def quantity(unit: str) -> Quantity | None:
    """Tell what a unit measures; None for a text that is no unit known here."""
    text = plain(unit)
    if text.lower() in ROTATIONS:
        return Quantity(angle=1, time=-1)
    if text.lower() in SPEEDS:
        return Quantity(length=1, time=-1)
    total, sign = {"angle": 0, "length": 0, "time": 0, "other": 0, "label": 0}, 1
    if not text or len(text) > 30:
        return None
    for place, part in enumerate(text.split("/")):
        sign = -1 if place else 1
        for factor in part.strip("()").split("*"):
            match = FACTOR.fullmatch("s" if place and factor == "S" else factor)  # RAD/S is no siemens
            what = match and _measures(match[1])
            if not match or what is None:
                return None
            total[what] += sign * int(match[2] or 1)
            total["other"] += what == "other"
    return Quantity(total["angle"], total["length"], total["time"], total["other"] != 0, total["label"] != 0)


class Motion(NamedTuple):
    """What a unit of a position or a velocity measures, and what it is in rad or m (per second)."""

    kind: Literal["angle", "length", ""]
    factor: float


def of_motion(unit: str) -> Motion:
    """Tell what a unit of a motion is: "mm" -> ("length", 0.001), "rpm" -> ("angle", 0.10472), "V" -> ("", 1)."""
    text = re.sub(r"\*([A-Za-z]+)\^?-1$", r"/\1", plain(unit))
    if text.lower() in ROTATIONS:
        return Motion("angle", TURN / 60)
    if text.lower() in SPEEDS:
        return Motion("length", SPEEDS[text.lower()])
    moved, _, per = text.partition("/")
    times, parts = TIMES.get(_word("s" if per == "S" else per), (0, 1)) if per else (1, 1)
    kind, factor = _moved(_word(moved))
    return Motion(kind, factor * parts / times) if kind and times else Motion("", 1.0)


def _moved(symbol: str) -> Motion:
    if symbol in ANGLES:
        return Motion("angle", ANGLES[symbol])
    if symbol in LENGTHS:
        return Motion("length", LENGTHS[symbol])
    if symbol[:1] in PREFIXES and symbol[1:] in ("m", "rad"):
        return Motion("length" if symbol[1:] == "m" else "angle", PREFIXES[symbol[0]])
    return Motion("", 1.0)


def seconds_in(unit: str) -> tuple[int, int] | None:
    """Give the seconds in a unit of time as numerator and denominator; None for any other unit."""
    return TIMES.get(_word(plain(unit)))


def plain(unit: str) -> str:
    """Write a unit with plain letters: 'µm' as 'um', '°C' as 'degC', 'rad·s⁻¹' as 'rad*s-1'."""
    text = unicodedata.normalize("NFKC", unit.replace("º", "°")).strip()
    text = text.replace("−", "-").replace("μ", "u").replace("**", "^")
    text = re.sub(r"(?:°|\bdeg\.?)\s*([CFK])\b", r"deg\1", text)
    text = text.replace("°", "deg")
    text = re.sub(r"\s*([/*·×⋅])\s*", r"\1", text)
    return re.sub(r"[·×⋅\s]", "*", text)


def _measures(symbol: str) -> str | None:
    """Name what one symbol measures, without its exponent."""
    symbol = _word(symbol)
    if moved := _moved(symbol).kind:
        return moved
    for what, symbols in (("time", TIMES), ("other", OTHERS)):
        if symbol in symbols:
            return what
    if symbol.lower() in LABELS:
        return "label"
    return "other" if symbol[0] in PREFIXES and symbol[1:] in PREFIXED else None


def _word(symbol: str) -> str:
    """Write words of three letters and more small: Rad, SEC, Volts."""
    small = symbol.lower()
    return small if len(symbol) > 2 and any(small in words for words in (ANGLES, LENGTHS, TIMES, OTHERS)) else symbol
