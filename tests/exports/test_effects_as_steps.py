"""The step of every effect, sample by sample, is its term over a whole record."""

import numpy as np
import pytest
from parameters_of_effects import scales, signal, values_of

from simgap.greybox.effects.effect import InputEffect, OutputEffect
from simgap.registry import EFFECTS
from simgap.step_form import StepForm, source_of

T = 120
SUBSTEP = 0.025


def effects_of(base):
    every = [law() for name in EFFECTS for law in EFFECTS[name].laws().values()]
    return [e for e in every if isinstance(e, base) and e.simulated and not e.own]


def stepped(effect, values, x, h, memory=0.0):
    """Run the step as an export has it: from its source alone."""
    names = [*(source_of(helper) for helper in effect.helpers), source_of(effect.step, "law")]
    law = StepForm("\n".join(names), {}, np.zeros(0), 1, 1, False).functions["law"]
    m = [7.0, memory, *[0.0] * max(0, effect.cells(values, h) - 1), 7.0]
    y = [law(value, [9.0, *values.tolist()], 1, m, 1, h, k) for k, value in enumerate(x.tolist())]
    assert m[0] == 7.0 and (effect.cells(values, h) == 0 or m[-1] == 7.0), "it writes beyond its cells"
    return np.array(y)


@pytest.mark.parametrize("effect", effects_of(InputEffect), ids=lambda e: e.name)
@pytest.mark.parametrize("memory", [0.0, -0.7, 1.0])
def test_an_input_passes_step_by_step_as_it_does_as_a_whole(effect, memory):
    u = np.repeat(signal(0), 4)
    for values in values_of(effect, scales()):
        if effect.memory:
            whole = effect.term_from(u[None], values, SUBSTEP, np.array([memory]))[0]
        else:
            whole = effect.term(u[None], values, SUBSTEP)[0]
        np.testing.assert_allclose(stepped(effect, values, u, SUBSTEP, memory), whole, rtol=0, atol=1e-12)


@pytest.mark.parametrize("effect", effects_of(OutputEffect), ids=lambda e: e.name)
@pytest.mark.parametrize("memory", [0.0, -0.7])
def test_a_reading_is_the_same_sample_by_sample(effect, memory):
    y, t = signal(1), 0.1 * np.arange(T)
    for values in values_of(effect, scales()):
        if effect.memory:
            whole = effect.term_from(y[None].copy(), values, t, np.array([memory]))[0]
        else:
            whole = effect.term(y[None].copy(), values, t)[0]
        np.testing.assert_allclose(stepped(effect, values, y, 0.1, memory), whole, rtol=0, atol=1e-12)


def test_every_effect_that_is_simulated_is_forecast_or_has_a_step():
    for name in EFFECTS:
        effect = EFFECTS[name]()
        if effect.port != "force" and effect.simulated and not effect.own:
            assert callable(effect.step), name
