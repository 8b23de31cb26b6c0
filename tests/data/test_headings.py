"""What headings say: names, units, which column is meant, which is the time, and what an output is."""

import numpy as np
import pandas as pd
import pytest

from simgap.data import load
from simgap.data.formats.headings import heading_of, time_unit
from simgap.data.kinds import kind_of
from simgap.data.loading import read
from simgap.units import of_motion, quantity, seconds_in

ROWS = 50


def frame(**columns: str) -> pd.DataFrame:
    """A time in steps of 0.1 and noise, under the given headings."""
    rng = np.random.default_rng(0)
    values = {"t": np.arange(ROWS) * 0.1, "u": rng.normal(size=ROWS), "y": rng.normal(size=ROWS)}
    return pd.DataFrame({columns.get(name, name): column for name, column in values.items()})


@pytest.mark.parametrize(
    ("text", "name", "unit"),
    [
        ("Speed [rad/s]", "Speed", "rad/s"),
        ("T1 (degC)", "T1", "degC"),
        ("Motor voltage [V]", "Motor voltage", "V"),
        ("Position_[µm]", "Position", "µm"),
        ("y[m]", "y", "m"),
        ("U / V", "U", "V"),
        ("Flow [scoops]", "Flow", "scoops"),
        ("a (b) [kPa]", "a (b)", "kPa"),
        ("speed", "speed", ""),
        ("x[0]", "x[0]", ""),
        ("x [0]", "x [0]", ""),
        ("f(x)", "f(x)", ""),
        ("y(t)", "y(t)", ""),
        ("Encoder (left)", "Encoder (left)", ""),
        ("joint[left]", "joint[left]", ""),
        ("[V]", "[V]", ""),
    ],
)
def test_a_heading_is_a_name_and_perhaps_a_unit(text, name, unit):
    heading = heading_of(text)
    assert (heading.name, heading.unit) == (name, unit)


@pytest.mark.parametrize("one", ["rad*s^-1", "rad s-1", "Rad/S", "rad·s⁻¹", "°/s", "rad/sec", "mrad/ms"])
def test_one_quantity_has_many_spellings(one):
    assert quantity(one) == quantity("rad/s")


@pytest.mark.parametrize("text", ["", "left", "x", "0", "12", "rad//s", "/", "^2", "m^", "filtered", "a" * 99])
def test_what_is_no_unit_is_none(text):
    assert quantity(text) is None


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("t", ""), ("Time", ""), ("TIME (s)", "s"), ("t_ms", "ms"), ("time [ms]", "ms"), ("T [s]", "s"),
        ("t, s", "s"), ("Timestamp", ""), ("TIME_US", "us"), ("Elapsed Time (min)", "min"), ("millis", "ms"),
        ("T_ms", "ms"), ("T_h", None), ("T_min", None), ("T_s", None), ("time [d]", "d"),
        ("T", None), ("T [degC]", None), ("t [degC]", None), ("t, left", None), ("time_step", None), ("thrust", None),
        ("x [s]", None),
    ],
)  # fmt: skip
def test_a_time_is_known_by_its_name_unless_its_unit_is_none_of_time(text, unit):
    assert time_unit(text) == unit


def test_units_of_time_are_exact():
    assert [10 * times / parts for times, parts in map(seconds_in, ("ms", "us", "min"))] == [0.01, 1e-5, 600]


@pytest.mark.parametrize(
    ("name", "unit", "kind"),
    [
        ("Speed", "rad/s", "velocity"), ("y", "mm/s", "velocity"), ("n", "rpm", "velocity"),
        ("Motor speed", "", "velocity"),
        ("x", "mm", "position"), ("phi", "°", "position"), ("encoder", "rev", "position"), ("angle", "", "position"),
        ("current position", "mm", "position"),
        ("Level", "cm", "level"), ("tank 1", "m", "level"), ("level", "", "level"), ("upperTankLevel", "%", "level"),
        ("T1", "degC", "other"), ("y", "V", "other"), ("i", "mA", "other"), ("valve", "%", "other"),
        ("F", "kN", "other"),
        ("p", "Pa", "other"), ("p", "bar", "other"), ("a", "m/s^2", "other"), ("Tank pressure", "bar", "other"),
        ("pressure", "", "other"),
        ("y", "", None), ("phi", "", None), ("Speed", "V", None), ("Position", "%", None), ("h", "cm", None),
        ("Height", "m", None), ("T", "deg", None), ("wheel", "ticks/s", None), ("n", "1/min", None),
        ("signal level", "V", None), ("noise level", "", None), ("angle rate", "", None), ("flow", "scoops", None),
    ],
)  # fmt: skip
def test_a_kind_is_read_only_where_name_and_unit_leave_no_doubt(name, unit, kind):
    assert kind_of(name, unit) == kind


@pytest.mark.parametrize("wanted", ["Motor speed [rad/s]", "Motor speed", "motor SPEED", "motor speed [RAD/S]"])
def test_a_column_is_meant_by_its_heading_or_its_name_in_any_capitals(wanted):
    channel = load(frame(y="Motor speed [rad/s]"), ["u"], [wanted]).channels.outputs[0]
    assert (channel.name, channel.unit) == ("Motor speed", "rad/s")
    assert (channel.kind, channel.kind_from) == ("velocity", "header")


def test_a_name_that_may_be_two_columns_is_refused_with_both(refused):
    both = frame(y="Speed [rad/s]").assign(**{"Speed [rpm]": 1.0})
    sentence = refused(both, ["u"], ["speed"])
    assert "'Speed [rad/s]', 'Speed [rpm]'" in sentence
    assert "in full" in sentence


def test_capitals_that_tell_two_columns_apart_are_kept():
    data = load(frame(u="U", y="u"), ["U"], ["u"])
    assert [data.channels.inputs[0].name, data.channels.outputs[0].name] == ["U", "u"]


def test_two_channels_of_one_name_keep_their_units_in_the_name():
    both = frame(u="x [V]", y="x [mm]")
    channels = load(both, ["x [V]"], ["x [mm]"]).channels
    assert [channels.inputs[0].name, channels.outputs[0].name] == ["x [V]", "x [mm]"]
    assert channels.outputs[0].unit == "mm"


def test_one_column_under_two_spellings_is_still_named_twice(refused):
    assert "named twice" in refused(frame(y="Speed [rad/s]"), ["speed"], ["Speed [rad/s]"])


def test_all_columns_are_listed_when_none_is_meant(refused):
    wide = frame().assign(**{f"sensor {i}": 0.0 for i in range(30)})
    assert "'sensor 9'" in refused(wide, ["u"], ["Y2"])
    assert "and 13 more" in refused(wide, ["u"], ["Y2"])


def test_a_file_of_two_columns_is_told_what_to_write(refused):
    sentence = refused(frame(t="Time (s)", u="Motor voltage [V]", y="Speed [rad/s]"))
    assert 'if "Motor voltage" drives Speed, write --input "Motor voltage" --output Speed' in sentence
    assert "the other way round" in sentence


def test_an_output_without_a_unit_and_a_telling_name_has_an_unknown_kind():
    channel = load(frame(), ["u"], ["y"]).channels.outputs[0]
    assert (channel.kind, channel.kind_from) == ("other", "unknown")


@pytest.mark.parametrize("kind", ["position", {"y": "position"}, {"Y": "position"}])
def test_a_kind_that_the_user_says_wins(kind):
    channel = load(frame(), ["u"], ["y"], kind=kind).channels.outputs[0]
    assert (channel.kind, channel.kind_from) == ("position", "option")


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("angle", "use one of position, velocity, level, other"),
        ("", "cannot be ''"),
        ({"v": "position"}, "there are the outputs 'y'"),
    ],
)
def test_a_kind_that_cannot_be_is_refused(refused, kind, said):
    assert said in refused(frame(), ["u"], ["y"], kind=kind)


def test_one_kind_for_two_outputs_is_refused(refused):
    assert "of which output" in refused(frame().assign(z=frame().y), ["u"], ["y", "z"], kind="level")


def test_the_kind_of_a_registered_data_set_or_a_folder_may_be_said(good):
    data = load(good, kind="velocity")
    assert data.channels.outputs[0].kind_from == "option"
    assert data.training.channels == data.channels
    assert data.sha256 == load(good).sha256


@pytest.mark.parametrize(
    ("unit", "kind", "factor"),
    [
        ("mm", "length", 1e-3), ("µm", "length", 1e-6), ("inch", "length", 0.0254), ("km/h", "length", 1 / 3.6),
        ("mm/min", "length", 1e-3 / 60), ("m·s⁻¹", "length", 1.0), ("rad/s", "angle", 1.0), ("mrad", "angle", 1e-3),
        ("Degrees", "angle", np.pi / 180), ("°/s", "angle", np.pi / 180), ("rpm", "angle", np.pi / 30),
        ("rev/min", "angle", np.pi / 30), ("V", "", 1.0), ("", "", 1.0), ("ticks", "", 1.0), ("m/V", "", 1.0),
        ("m·min⁻¹", "length", 1 / 60),
    ],
)  # fmt: skip
def test_a_unit_of_a_motion_says_what_it_is_in_si(unit, kind, factor):
    assert of_motion(unit) == (kind, pytest.approx(factor))


@pytest.mark.parametrize(("heading", "said"), [("t", True), ("seconds", False), ("time_s", False), ("time [s]", False)])
def test_a_slow_time_is_taken_for_seconds_aloud_unless_its_heading_says_so(heading, said):
    log = frame(t=heading)
    log[heading] *= 20.0
    assert any("taken for seconds" in text for text in read(log, ["u"], ["y"]).said) == said


def test_milliseconds_since_1970_are_no_seconds_whatever_the_heading_says(refused):
    log = frame(t="time [s]")
    log["time [s]"] = 1714557600000 + 10 * np.arange(ROWS)
    assert "is no time of a record; correct the unit in the heading" in refused(log, ["u"], ["y"])


def test_a_time_that_is_named_as_an_input_is_told_to_be_the_time(refused):
    assert "'t' is the time, and cannot be an input or output" in refused(frame(), ["t"], ["y"], split_gaps=True)
    assert len(load(frame(), ["t"], ["y"], dt=0.1).channels.inputs) == 1
