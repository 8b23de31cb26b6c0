"""A fitted model as one step, in a subset of Python that other languages can follow."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

Step = Callable[[list[float], list[float], list[float]], None]


@dataclass(frozen=True, eq=False)
class StepForm:
    """y(k) from u(k) and the state: `source` holds functions, `step(s, u, y)` the last of them.

    It fills y [ny] from u [nu] and takes the state s [ns] from before sample k to before sample k + 1. All are lists of
    floats. The functions know `math`, `abs min max round`, each other and the `constants` by their names, whose arrays
    they read as flat lists; they hold loops over ranges, branches and assignments, nothing else. `rest` [ns] is the
    state at rest; `direct` tells whether y(k) depends on u(k) already; `held` are inputs that keep one value in a run,
    such as the mass that a machine carries.
    """

    source: str
    constants: dict[str, Float[np.ndarray, " _"]]
    rest: Float[np.ndarray, " ns"]
    nu: int
    ny: int
    direct: bool
    held: tuple[int, ...] = ()

    @cached_property
    def functions(self) -> dict[str, Any]:
        """The functions of the source, to be called from Python."""
        import math

        names: dict[str, Any] = {"math": math, **{name: array.tolist() for name, array in self.constants.items()}}
        exec(compile(self.source, "<step form>", "exec"), names)  # our own text; from a file it has numbers only
        return names

    @property
    def step(self) -> Step:
        """The step in Python."""
        step: Step = self.functions["step"]
        return step

    def run(self, u: Float[np.ndarray, "T nu"], start: Float[np.ndarray, " ns"]) -> Float[np.ndarray, "T ny"]:
        """Step through a record from a state, in Python."""
        return self.run_on(u, start)[0]

    def run_on(
        self, u: Float[np.ndarray, "T nu"], start: Float[np.ndarray, " ns"]
    ) -> tuple[Float[np.ndarray, "T ny"], Float[np.ndarray, " ns"]]:
        """Step through a record, and give the state after it too."""
        step, s, y = self.step, start.tolist(), [0.0] * self.ny
        rows = []
        for row in u.tolist():
            step(s, row, y)
            rows.append(y.copy())
        return np.array(rows).reshape(-1, self.ny), np.array(s)


def source_of(function: Any, name: str = "") -> str:
    """Return the text of a function without its decorators, under another name if one is given."""
    function = inspect.unwrap(getattr(function, "py_func", function))
    text = textwrap.dedent(inspect.getsource(function))
    text = text[re.search(r"^def ", text, re.MULTILINE).start() :]  # type: ignore[union-attr]
    text = re.sub(r"  # noqa.*", "", text)
    return re.sub(r"^def \w+", f"def {name}", text) if name else text


HOLD = '''\
def step(s: list, u: list, y: list):
    """Give the same outputs at every sample."""
    for i in range({ny}):
        y[i] = s[i]
'''


def constant(level: Float[np.ndarray, " ny"], nu: int) -> StepForm:
    """Write a model whose outputs never change as a step; they are its state."""
    return StepForm(HOLD.format(ny=len(level)), {}, level, nu, len(level), False)
