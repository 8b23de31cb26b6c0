"""The table [plant] of a dataset.toml: what it says, in SI units, and one sentence for each that cannot be used."""

import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import simgap
from simgap.data.formats.plant_table import parse_known, read_forces, read_plant
from simgap.data.formats.plant_writing import plant_lines
from simgap.data.simulated.rigs import hide
from simgap.records import Channel, Channels, UnusableInput

SERVO = Channels(
    (Channel("goal", "deg"), Channel("on"), Channel("volts", "mV"), Channel("kp"), Channel("load", "g"),
     Channel("arm", "cm")),
    (Channel("q", "rad", "position"),),
)  # fmt: skip
TABLE = {
    "mass": "load", "arm": "arm", "supply": "volts", "enabled": "on", "gravity": True,
    "controller": {"goal": "goal", "gain": "kp"},
}  # fmt: skip
TWO = Channels((Channel("a"), Channel("b")), (Channel("x", "m", "position"),))
TANK = Channels((Channel("pump", "V"),), (Channel("h", "cm", "level"),))
CART = Channels((Channel("force", "N"),), (Channel("x", "m", "position"),))


def test_columns_are_turned_into_si_units():
    plant = read_plant(TABLE, SERVO, "d")
    assert (plant.input, plant.controlled, plant.enabled) == ("goal", True, "on")
    assert plant.mass.column == "load" and plant.mass.factor == 1e-3
    assert plant.arm.factor == 1e-2 and plant.supply.factor == 1e-3
    assert plant.goal_factor == pytest.approx(np.pi / 180)
    assert plant.gravity == pytest.approx(9.80665)


def test_numbers_come_with_units_and_doubted_ones_with_an_interval():
    plant = read_plant({"mass": "500 g", "damping": {"low": 0.1, "high": 0.3}}, CART, "d")
    assert plant.mass.certain and plant.mass.value == 0.5
    assert not plant.damping.certain and plant.damping.value == pytest.approx(0.2)
    assert plant.input == "force"


TICKS = Channels((Channel("goal", "ticks"), Channel("m", "kg")), (Channel("q", "ticks", "position"),))
MIXED = Channels((Channel("goal", "ticks"), Channel("m", "kg")), (Channel("q", "deg", "position"),))


@pytest.mark.parametrize(
    ("channels", "table"),
    [
        (SERVO, TABLE),
        (SERVO, {**TABLE, "hangs_at": 0.3, "gravity": 1.62}),
        (CART, {"mass": "500 g", "damping": {"low": 0.1, "high": 0.3}}),
        (CART, {"inertia": {"low": 1.0, "value": 1.2, "high": 2.0}}),
        (TANK, {"area": "20 cm^2"}),
        (TICKS, {"mass": "m", "ticks_per_turn": 4096, "controller": {"goal": "goal", "gain": 3, "derivative": 0.1}}),
        (MIXED, {"mass": "m", "ticks_per_turn": 4096, "controller": {"goal": "goal", "gain": {"low": 1, "high": 2}}}),
    ],
)
def test_a_table_that_is_written_is_read_as_the_same(channels, table):
    plant = read_plant(table, channels, "d")
    written = tomllib.loads("\n".join(plant_lines(plant, channels)))["plant"]
    again = read_plant(written, channels, "d")
    assert again.goal_factor == pytest.approx(plant.goal_factor, rel=1e-14)
    assert again.radian == pytest.approx(plant.radian, rel=1e-14)
    assert replace(again, goal_factor=plant.goal_factor, radian=plant.radian) == plant


def test_a_saved_data_set_keeps_what_is_known_of_its_machine(tmp_path):
    data = hide("servo", {"torque_foldback": 1.0})
    simgap.save(data, tmp_path / "servo")
    assert simgap.load(tmp_path / "servo").channels.plant == data.channels.plant


@pytest.mark.parametrize(
    ("channels", "table", "says"),
    [
        (CART, {"maas": 1.0}, "unknown key 'maas'"),
        (CART, {"mass": -1.0}, "mass is -1; it must be positive"),
        (CART, {"mass": "0.5 V"}, "mass is in 'V'; write it in one of kg, g"),
        (CART, {"inertia": "5 m2"}, "inertia is in 'm2'; write it in one of kgm2"),
        (SERVO, {**TABLE, "controller": {"goal": "r", "gain": "5 mV/deg"}}, "gain is in 'mV/deg'; write it without"),
        (CART, {"mass": "load"}, "'load', which is no input; there are force"),
        (CART, {"mass": {"low": 2, "high": 1}}, "low < high"),
        (CART, {"mass": [1]}, "give a number"),
        (CART, {"arm": 0.1}, "arm needs the mass"),
        (CART, {"gravity": True}, "gravity needs mass and arm"),
        (CART, {"mass": 1.0, "arm": 1.0, "gravity": True}, "gravity acts on an angle"),
        (CART, {"controller": {"gain": 1.0}}, "goal is missing"),
        (CART, {"controller": 3}, "controller must be a table"),
        (TWO, {}, "which input drives it? Write input = one of a, b"),
        (TANK, {"mass": "1 kg"}, "mass is nothing of a level; a tank has an area, so leave it out"),
        (CART, {"area": "1 m^2"}, "area is nothing of a position; a body has a mass or an inertia, so leave it out"),
        (SERVO, {**TABLE, "supply": 12.0}, "does not say what 'volts' is"),
        (SERVO, {**TABLE, "supply": "load"}, "named twice"),
        (Channels((Channel("u"),), (Channel("y"),)), {}, "whose kind is position, velocity or level"),
        (Channels((Channel("u", "ticks"),), (Channel("y", "ticks", "position"),)), {}, "add ticks_per_turn"),
    ],
)
def test_a_bad_table_gets_one_sentence(channels, table, says):
    with pytest.raises(UnusableInput, match=r"^d: \[plant\]") as raised:
        read_plant(table, channels, "d")
    assert says in str(raised.value)


def test_an_option_that_needs_a_kind_names_the_option_that_says_it(refused):
    log = pd.DataFrame({"t": np.arange(50) * 0.1, "u": np.sin(np.arange(50)), "my y": np.arange(50.0)})
    said = refused(log, ["u"], ["my y"], known={"mass": "1 kg"})
    assert 'add --kind "my y=velocity", or position or level (kind=.. in Python), or leave --known out' in said
    assert "[plant]" not in said
    assert "there are 'u', 'my y'; name one of them" in refused(log, ["t"], ["u", "my y"], dt=0.1, known={"mass": 1.0})


def test_options_are_written_like_mass_0_5_kg():
    assert parse_known(["mass=0.5kg", "arm=10..12cm", "gravity=true", "controller.goal=r"]) == {
        "mass": "0.5kg", "arm": {"low": "10cm", "high": "12cm"}, "gravity": True, "controller": {"goal": "r"},
    }  # fmt: skip
    with pytest.raises(UnusableInput, match=r"must be written like mass=0\.5kg"):
        parse_known(["mass"])
    for twice in (["mass=1kg", "mass=3kg"], ["controller=r", "controller.gain=2"], ["mass=1kg", "mass.low=2"]):
        with pytest.raises(UnusableInput, match="given twice"):
            parse_known(twice)


def test_a_torque_constant_has_its_unit():
    assert read_forces({"torque_constant": "50 mNm/A"}) == {"torque_constant": pytest.approx(0.05)}


def test_what_a_folder_says_of_its_machine_is_not_replaced_by_an_option(tmp_path):
    write(tmp_path, [lambda k: 1.0, lambda k: 2.0])
    with pytest.raises(UnusableInput, match=r"has a table \[plant\] already; write --known into that"):
        simgap.load(tmp_path, known={"damping": 1.0})


def write(folder, masses):
    for split in ("train", "test"):
        (folder / split).mkdir()
        for i, mass in enumerate(masses):
            rows = "\n".join(f"{np.sin(0.3 * k)},{mass(k)},{np.sin(0.3 * k - 1)}" for k in range(80))
            (folder / split / f"{i}.csv").write_text("force,m,x\n" + rows)
    (folder / "dataset.toml").write_text(
        'name = "cart"\nsampling_time = 0.1\n[[inputs]]\nname = "force"\n[[inputs]]\nname = "m"\nunit = "kg"\n'
        '[[outputs]]\nname = "x"\nunit = "m"\nkind = "position"\n'
        '[splits]\ntrain = "train/*.csv"\ntest = "test/*.csv"\n[plant]\nmass = "m"\n'
    )


def test_a_folder_hands_its_table_on(tmp_path):
    write(tmp_path, [lambda k: 1.0, lambda k: 2.0])
    data = simgap.load(str(tmp_path))
    assert data.channels.plant.mass.column == "m"
    assert data.training.channels.plant is data.channels.plant


def test_a_mass_that_changes_within_an_experiment_is_refused(tmp_path):
    write(tmp_path, [lambda k: 1.0 + (k > 40)])
    with pytest.raises(UnusableInput, match=r"the column 'm' changes in .*; mass must be one positive number"):
        simgap.load(str(tmp_path))
