"""The step of a grey box repeats the compiled simulation: every effect, every kind of plant, in Python and in C."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from parameters_of_effects import scales, values_of
from plants_without_a_fit import DT, PLANTS, grey_box, record

from simgap.exports.folders import About
from simgap.exports.formats import c
from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.subjects import CheckRecord, Subject
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.noise import white
from simgap.greybox.plant import Plant
from simgap.records import Channels, UnusableInput
from simgap.registry import EFFECTS
from simgap.saved.archive import FittedOn

ABOUT = About("c", "greybox", DT, ("u",), ("y",), 1e-6, ())


def differs(model, u, y_init, run=None):
    """The largest difference between the step and our simulation over the rows after the start, relative."""
    n = len(y_init)
    grey = GreyBoxStep(model, u.shape[1], y_init.shape[1])
    start = grey.start(u, y_init)
    y = (run or grey.form.run)(u[n:], start)
    record = CheckRecord("record", u, y_init, model.simulate(u[None], y_init[None])[0], start)
    return record.difference(y)


@pytest.mark.parametrize("name", PLANTS)
def test_a_plant_without_effects_runs_as_ours(name):
    assert differs(grey_box(name), *record(name)) < 1e-12


LAWS = {name: EFFECTS[name] for name in EFFECTS}
LAWS |= {f"steady {name}": effect.steady for name, effect in LAWS.items() if effect.steady}


def plants_for(effect):
    """The plants on which an effect makes sense."""
    on_all = [name for name, (kind, order, *_) in PLANTS.items() if LAWS[effect]().applies_to(scales(kind, order))]
    return [name for name in on_all if name != "imposed" or LAWS[effect].role not in ("stop", "rim", "outflow")]


# One that acts on the command of a controller inside has no plant here: such machines are not exported.
FORECAST = [name for name, law in LAWS.items() if law.simulated and not law.own and plants_for(name)]


def check_on(plant, effect):
    kind, order, *_ = PLANTS[plant]
    law = LAWS[effect]()
    models = [grey_box(plant, [law], [values]) for values in values_of(law, scales(kind, order))]
    u, y_init = record(plant)
    bounded = [model for model in models if np.abs(model.simulate(u[None], y_init[None])).max() < 1e6]
    assert bounded
    assert max(differs(model, u, y_init) for model in bounded[-2:]) < 1e-9


@pytest.mark.parametrize(("number", "effect"), list(enumerate(FORECAST)))
def test_a_plant_with_an_effect_runs_as_ours(number, effect):
    plants = plants_for(effect)
    check_on(plants[number % len(plants)], effect)


@pytest.mark.slow
@pytest.mark.parametrize("effect", FORECAST)
def test_every_plant_that_an_effect_suits_runs_as_ours_with_it(effect):
    for plant in plants_for(effect):
        check_on(plant, effect)


def test_the_effects_of_a_model_pass_each_other_in_the_order_of_the_chain(tmp_path):
    names = ("backlash", "input_saturation", "input_delay", "load_friction", "gravity", "hysteresis", "curved_sensor")
    terms = [EFFECTS[name]() for name in names]
    model = grey_box("position", terms, [values_of(term, scales())[0] for term in terms])
    assert differs(model, *record("position")) < 1e-9


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
@pytest.mark.parametrize(
    ("plant", "names"),
    [
        ("position", ("backlash", "input_delay", "stribeck_friction", "hysteresis", "hard_stop", "sensor_lag")),
        ("velocity", ("valve_stiction", "rate_limit", "load_friction", "quadratic_drag", "quantisation")),
        ("two masses", ("actuator_lag", "coulomb_friction", "curved_sensor")),
        ("tanks", ("curved_input", "sqrt_outflow", "overflow", "sensor_saturation")),
        ("tanks", ("finer curved_input", "sqrt_outflow", "overflow", "finer curved_sensor")),
        ("velocity", ("finer inner_saturation", "coulomb_friction")),
        ("velocity", ("limited_braking", "quadratic_drag")),
        ("imposed", ("backlash", "coulomb_friction", "hysteresis")),
        ("imposed", ("coulomb_friction", "finer hysteresis")),
        ("position", ("backlash", "finer hysteresis")),
    ],
)
def test_in_c_it_runs_as_ours(plant, names, tmp_path):
    kind, order, *_ = PLANTS[plant]
    finer = [name.startswith("finer ") for name in names]
    of_name = [EFFECTS[name.removeprefix("finer ")] for name in names]
    terms = [effect.refined() if fine else effect() for effect, fine in zip(of_name, finer, strict=True)]
    sets = [values_of(term, scales(kind, order)) for term in terms]
    # A finer law begins where it is still the simple one.
    model = grey_box(plant, terms, [values[-1 if fine else 0] for values, fine in zip(sets, finer, strict=True)])
    u, y_init = record(plant)

    def compiled(after, start):
        fitted_on = FittedOn("rig", "", DT, len(y_init), Channels.unnamed(1, y_init.shape[1]))
        of_record = CheckRecord("record", after, y_init[:0], np.zeros((len(after), y_init.shape[1])), start)
        subject = Subject("greybox", model, fitted_on, (of_record,), np.zeros((2, 1)), np.zeros((2, 1)))
        c.write(subject, tmp_path)
        return c.run(tmp_path, ABOUT, of_record)

    assert differs(model, u, y_init, compiled) < 1e-9


def test_an_output_that_needs_the_next_sample_is_refused():
    kind, order, fields, _ = PLANTS["imposed"]
    plant = Plant(kind, order, 1, DT, zeros=1, **fields)
    state = {"plant": plant, "theta": np.ones(plant.size), "noise": white(np.ones(1)), "outputs": (0,), "outliers": (),
             "usual": None}  # fmt: skip
    with pytest.raises(UnusableInput, match="sample after the present one"):
        GreyBoxStep(GreyBoxModel([FittedPlant.from_saved(state)]), 1, 1)


def test_a_law_and_its_finer_form_in_one_model_do_not_take_each_others_name():
    coarse = EFFECTS["curved_input"]()
    fine = coarse.refined()
    plants = [grey_box("velocity", [one], [values_of(one, scales("velocity", 1))[-1]]).plants[0]
              for one in (coarse, fine)]  # fmt: skip
    model = GreyBoxModel([plants[0], replace(plants[1], outputs=(1,))])
    u, y_init = record("velocity")
    assert differs(model, u, np.column_stack((y_init, y_init))) < 1e-9
