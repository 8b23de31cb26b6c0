"""`gymnasium`: environment.py, an environment whose plant is the model; the task is to hold the outputs at a target."""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.exports.folders import About
from simgap.exports.formats import python
from simgap.exports.formats.control import imported
from simgap.exports.ranges import variants
from simgap.exports.subjects import CheckRecord, Subject, refusal_of_step
from simgap.exports.texts import numbers, plain

FILE = "environment.py"
IMPORTS = "import gymnasium\nimport numpy as np\n"
ENVIRONMENT = '''

class Plant(gymnasium.Env):
    """A plant in discrete time, sampled every DT seconds.

    An action holds the inputs, in the range of the data that the model was fitted on, for one sample; nothing clips it.
    The observation holds the outputs after it{when}, then the target that the reward asks for:
    minus the mean square of (output - target) over the outputs' range. `reset(seed=..)` draws the target from that
    range; options: "start", a state (at rest by default), and "target". An episode ends after `horizon` samples.

    With randomise=True every episode has a plant of its own, drawn from VARIANTS: the parameters as a repeat of the
    experiments would find them. options "variant": its number, or None for the model that was fitted.
{held}    """

    metadata = {{"render_modes": [], "render_fps": max(1, round(1 / DT))}}

    def __init__(self, horizon=500, render_mode=None, randomise=False):
        self.horizon, self.render_mode, self.randomise, self.numbers = horizon, render_mode, randomise, FITTED
        ends = np.array([LOWEST_INPUT, LARGEST_INPUT])[:, ACTING]
        self.action_space = gymnasium.spaces.Box(*ends, dtype=np.float64)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2 * len(OUTPUTS),), dtype=np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        options = options or {{}}
        drawn = self.np_random.uniform(LOWEST_OUTPUT, LARGEST_OUTPUT)
        self.target = np.array(options.get("target", drawn), dtype=np.float64)
        drawn = int(self.np_random.integers(len(VARIANTS))) if self.randomise and VARIANTS else None
        variant = options.get("variant", drawn)
        self.numbers = FITTED if variant is None else VARIANTS[variant]
        held = [OF_RECORD[i] for i in HELD]
        if self.randomise and HELD:
            held = [self.np_random.uniform(LOWEST_INPUT[i], LARGEST_INPUT[i]) for i in HELD]
        self.held = options.get("held", held)
        self.state, self.samples = list(options.get("start", REST)), 0
        middle = np.clip(0.0, self.action_space.low, self.action_space.high)
        return self._observation(self._outputs(middle)), {{}}

    def step(self, action):
        outputs = [0.0] * len(OUTPUTS)
        globals().update(self.numbers)
        step(self.state, self._inputs(action), outputs)
        y = np.array(outputs) if DIRECT else self._outputs(action)
        self.samples += 1
        span = np.array(LARGEST_OUTPUT) - np.array(LOWEST_OUTPUT)
        reward = -float(np.mean(((y - self.target) / np.where(span > 0, span, 1.0)) ** 2))
        return self._observation(y), reward, False, self.samples >= self.horizon, {{}}

    def _outputs(self, action):
        """Read the outputs at the present sample; the state stays."""
        outputs = [0.0] * len(OUTPUTS)
        globals().update(self.numbers)
        step(list(self.state), self._inputs(action), outputs)
        return np.array(outputs)

    def _inputs(self, action):
        """Put what acts beside what the episode holds."""
        inputs = dict(zip(ACTING + HELD, [*action, *self.held]))
        return [float(inputs[i]) for i in range(len(INPUTS))]

    def _observation(self, y):
        return np.concatenate((y, self.target))
'''

HELD = """
    These inputs keep one value in an episode and are no part of the action: {names}.
    options "held": their values; by default those of the record, with randomise=True drawn from the range of the data.
"""

refusal = refusal_of_step


def missing() -> str:
    """Say what is missing to run it: Gymnasium."""
    return "" if importlib.util.find_spec("gymnasium") else "Gymnasium is not installed; pip install 'simgap[export]'"


def write(subject: Subject, folder: Path) -> None:
    """Write environment.py."""
    form, y = subject.form, subject.output_range
    limits = {"LOWEST_INPUT": subject.input_range[0], "LARGEST_INPUT": subject.input_range[1],
              "LOWEST_OUTPUT": y[0], "LARGEST_OUTPUT": y[1]}  # fmt: skip
    lines = "".join(f"{name} = [{numbers(value)}]\n" for name, value in limits.items())
    lines += f"FITTED = {{{', '.join(f'{name!r}: {name}' for name in form.constants)}}}\n"
    lines += f"VARIANTS = [{''.join(_variant(one) for one in variants(subject))}]\n"
    when = ", which it changes at once" if form.direct else ", at the next sample"
    held, of_record = list(form.held), subject.records[0].u[0]
    lines += f"HELD = {held}  # of the inputs: those that an episode holds\n"
    lines += f"ACTING = {[i for i in range(form.nu) if i not in held]}\nOF_RECORD = [{numbers(of_record)}]\n"
    names = ", ".join(subject.fitted_on.channels.inputs[i].name for i in held)
    about_held = HELD.format(names=plain(names)) if held else ""
    texts = python.parts(subject, IMPORTS), f"DIRECT = {form.direct}\n", lines, "\n\n", form.source
    (folder / FILE).write_text("".join(texts) + ENVIRONMENT.format(when=when, held=about_held), encoding="utf-8")


def _variant(constants: Mapping[str, np.ndarray]) -> str:
    listed = ", ".join(f"{name!r}: [{', '.join(repr(float(v)) for v in of)}]" for name, of in constants.items())
    return f"\n    {{{listed}}},"


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Let Gymnasium check the environment, then act as the record does."""
    from gymnasium.utils.env_checker import check_env

    module = imported(folder / FILE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of an observation space without bounds, say
        check_env(module.Plant(), skip_render_check=True)
    environment, ny = module.Plant(horizon=len(record.u)), record.y_hat.shape[1]
    held = record.u[0, module.HELD].tolist()
    first, _ = environment.reset(seed=0, options={"start": record.start.tolist(), "held": held})
    rows = [first, *(environment.step(u)[0] for u in record.u[record.n :, module.ACTING])]
    return np.array(rows)[1:, :ny] if module.DIRECT else np.array(rows)[:-1, :ny]
