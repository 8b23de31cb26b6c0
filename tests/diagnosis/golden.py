"""The answers of `simgap diagnose` that are kept: rigs with hidden effects, and measured machines.

python tests/diagnosis/golden.py FOLDER          every answer in full, to compare commits to the bit
python tests/diagnosis/golden.py                 the kept answers anew, after a change that is meant to move them

They are those of OpenBLAS with its Haswell kernels, as `make test` runs it: with others a few fits end elsewhere.
"""

from __future__ import annotations

import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any

KEPT = Path(__file__).parent / "golden"
SHARED = Path(os.environ.get("SIMGAP_DATA", Path(__file__).parents[2] / ".." / "shared" / "data"))
# Name: rig, effects with their strengths, noise, its colour, seed.
RIGS: dict[str, tuple[str, dict[str, float], float, float, int]] = {
    "cart-clean": ("cart", {}, 0.05, 0.9, 11),
    "cart-coulomb": ("cart", {"coulomb_friction": 1.0}, 0.05, 0.0, 12),
    "cart-stribeck": ("cart", {"stribeck_friction": 1.0}, 0.02, 0.0, 13),
    "cart-lag": ("cart", {"actuator_lag": 0.5}, 0.05, 0.0, 14),
    "cart-outliers": ("cart", {"outliers": 1.0}, 0.02, 0.0, 15),
    "cart-quantisation": ("cart", {"quantisation": 1.0}, 0.02, 0.0, 16),
    "stage-torque": ("stage", {"position_torque": 1.0}, 0.05, 0.0, 17),
    "stage-cubic": ("stage", {"cubic_stiffness": 0.5}, 0.05, 0.6, 18),
    "stage-backlash": ("stage", {"backlash": 1.0}, 0.05, 0.0, 19),
    "stage-absolute": ("stage", {"absolute_sensor": 1.0}, 0.05, 0.0, 20),
    "slide-hysteresis": ("slide", {"hysteresis": 1.0}, 0.05, 0.0, 21),
    "slide-delay": ("slide", {"input_delay": 0.5}, 0.05, 0.0, 22),
    "slide-pair": ("slide", {"quadratic_drag": 1.0, "dead_zone": 1.0}, 0.05, 0.0, 23),
    "slide-outside": ("slide", {"missing_input": 1.0}, 0.05, 0.0, 24),
    "slide-outside-force": ("slide", {"negative_damping": 1.0}, 0.02, 0.0, 25),
    "tank-sqrt": ("tank", {"sqrt_outflow": 1.0}, 0.02, 0.0, 26),
    "tanks-overflow": ("tanks", {"overflow": 1.0, "sqrt_outflow": 1.0}, 0.02, 0.0, 27),
    "tanks-drift": ("tanks", {"sensor_drift": 1.0}, 0.02, 0.0, 28),
}
MEASURED = (
    "arm_pendulum", "buck_converter", "damper_20lb", "damper_36lb", "dart_car", "loop_FIC20102", "loop_FIC40102C",
    "loop_FIC46005", "loop_LIC30102", "loop_LIC30501", "loop_LIC44001", "loop_PDIC10321", "servo_xl330",
    "servo_xl330_goal", "two_heaters",
)  # fmt: skip
# With the likelihood profiles of all parameters.
PROFILED = ("cart-coulomb", "stage-cubic")
# Sentences for people, what the data set says itself, and what no two runs agree on.
WORDS = ("text", "title", "separate_by", "deciding_experiment", "checks", "kinds", "seconds")


def folder_of(name: str) -> Path:
    """Where a measured set lies."""
    return SHARED / "measured" / name


def answer(name: str) -> dict[str, Any]:
    """The whole answer, or the exception that a diagnosis ended with."""
    from simgap.data.simulated.rigs import hide
    from simgap.diagnosis.diagnose import diagnose

    data: Any = str(folder_of(name))
    if name in RIGS:
        rig, effects, noise, colour, seed = RIGS[name]
        data = hide(rig, effects, noise, colour, seed)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            findings = diagnose(data, profiles=name in PROFILED).findings
    except Exception as error:
        return {"traceback": type(error).__name__}
    profiles = [[list(profile.deviance) for profile in cause.profiles] for cause in findings.causes]
    return json.loads(json.dumps(findings.to_json() | {"profiles": profiles, "seconds": 0.0}))


def without_words(value: Any) -> Any:
    """Verdicts, names and numbers of an answer."""
    if isinstance(value, dict):
        return {key: without_words(part) for key, part in value.items() if key not in WORDS}
    return [without_words(part) for part in value] if isinstance(value, list) else value


def differences(kept: Any, now: Any, at: str = "") -> list[str]:
    """Where two answers differ: names at all, parameters by over 1 % of their intervals, other numbers by over 0.1 %.

    Another processor ends a fit elsewhere within what it may leave to gain, 0.001 of twice the log-likelihood: that is
    0.03 standard errors, or 0.8 % of an interval. A log-likelihood ratio is compared to 0.1: that of one-step errors is
    not what a fit minimises. Shares of the plain error are compared as such.
    """
    if isinstance(kept, dict) and isinstance(now, dict):
        found = [f"{at}.{key} is only in one" for key in kept.keys() ^ now.keys()]
        of_interval = 0.01 * (kept["high"] - kept["low"]) if {"value", "low", "high"} <= kept.keys() else 0.0
        enough = {"value": of_interval, "low": of_interval, "high": of_interval, "log_likelihood_ratio": 0.1}
        for key in kept.keys() & now.keys():
            alike = enough.get(key, 0.0) and abs(kept[key] - now[key]) <= enough[key]
            found += [] if alike else differences(kept[key], now[key], f"{at}.{key}")
        return found
    if isinstance(kept, list) and isinstance(now, list) and len(kept) == len(now):
        return [d for i, pair in enumerate(zip(kept, now, strict=True)) for d in differences(*pair, f"{at}[{i}]")]
    numbers = isinstance(kept, int | float) and isinstance(now, int | float)
    least = 1.0 if at.startswith(".budget") else 1e-6
    same = abs(kept - now) <= 1e-3 * max(abs(kept), abs(now), least) if numbers and kept != now else kept == now
    return [] if same else [f"{at}: {kept!r} is now {now!r}"]


def main() -> None:
    """Write the answers."""
    os.environ["OPENBLAS_CORETYPE"] = "Haswell"  # before numpy is imported
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else KEPT
    folder.mkdir(parents=True, exist_ok=True)
    for name in (*RIGS, *MEASURED):
        if name in MEASURED and not folder_of(name).is_dir():
            continue
        found = answer(name)
        found = found if len(sys.argv) > 1 else without_words(found)
        (folder / f"{name}.json").write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        print(name, found.get("verdict", found.get("traceback")), flush=True)


if __name__ == "__main__":
    main()
