"""The log of a cart with dry friction, as a file."""

from pathlib import Path

import numpy as np


def write_cart(path: Path, samples: int = 500, seed: int = 0, heading: str = "t,force,v") -> None:
    """m dv/dt = force - d v - F sign(v), F = 0.6 N, m = 1 kg, d = 0.4 N s/m, by steps of 1 ms; sampled every 0.1 s."""
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.uniform(-3, 3, samples // 10 + 1), 10)[:samples]
    speed, v = 0.0, np.zeros(samples)
    for k in range(samples - 1):
        for _ in range(100):
            pull = force[k] - 0.4 * speed
            pull -= 0.6 * np.sign(speed) if speed else np.clip(pull, -0.6, 0.6)
            after = speed + 0.001 * pull
            speed = 0.0 if after * speed < 0 else after
        v[k + 1] = speed
    columns = np.column_stack((0.1 * np.arange(samples), force, v + rng.normal(scale=0.01, size=samples)))
    np.savetxt(path, columns, fmt="%.6g", delimiter=",", header=heading, comments="")
