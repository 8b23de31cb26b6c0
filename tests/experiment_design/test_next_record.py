"""`simgap next`: rivals, a record within the limits, its CSV and JSON, and what no record can tell."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from twins import PAIRS, STREAMS

import simgap
from simgap.cli import main
from simgap.data.simulated.rigs import hide
from simgap.experiment_design.limits import limits_of
from simgap.experiment_design.rivals import with_outputs
from simgap.experiment_design.search import best_record
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet, UnusableInput

TWINS = PAIRS["friction or dead zone"]


@pytest.fixture(scope="module")
def data():
    """Slow records of a cart with a dead zone, which look as if it had friction."""
    return TWINS.at_hand(TWINS.machines["dead_zone"], 1)


@pytest.fixture(scope="module")
def answer(data):
    return simgap.next_record(data, input_range=(-4.0, 3.0), rate=30.0, seconds=6.0, travel=(-1.5, 1.6))


def test_what_two_outputs_leave_open_is_told_apart_by_their_names(answer):
    (question,) = answer.questions
    assert with_outputs([question], answer.channels) == [question]
    of_both = with_outputs([question, replace(question, outputs=(1,))], Channels.unnamed(1, 2))
    pairs = replace(answer, questions=tuple(of_both)).rivals
    assert len(set(pairs)) == 2 * len(question.pairs)
    assert {title.rpartition(" for ")[2] for pair in pairs for title in pair} == {"y0", "y1"}


def test_what_the_records_leave_open_is_named_with_the_record_that_decides(answer):
    titles = {title for pair in answer.rivals for title in pair}
    assert {"Coulomb friction", "a dead zone of the actuator"} <= titles
    assert answer.decides
    assert str(answer).startswith(f"{answer.dataset}: The records do not tell ")
    assert "The record below would, with a chance of" in " ".join(str(answer).split())


def test_a_machine_that_may_run_away_stays_within_the_travel_under_the_record():
    """A softening spring lets go beyond 2.4 rad; its estimated numbers alone allow a record that ends there."""
    twins, seed = PAIRS["spring or sine"], 16
    machine = twins.machines["cubic_stiffness"]
    span, travel = (-twins.largest, twins.largest), (-twins.travel, twins.travel)
    answer = simgap.next_record(
        twins.at_hand(machine, seed), seed=seed, input_range=span, rate=1e9, seconds=8.0, travel=travel
    )
    record = machine.record(answer.u[:, 0], 0.0, (seed, STREAMS["new"]))
    assert np.max(np.abs(record.y)) < twins.travel


def test_the_record_is_longer_where_one_as_long_as_those_at_hand_would_not_decide():
    twins = PAIRS["delay or lag"]
    data, usual = twins.at_hand(twins.machines["actuator_lag"], 5), 12.0
    span, travel = (-twins.largest, twins.largest), (-twins.travel, twins.travel)
    answer = simgap.next_record(data, seed=5, input_range=span, rate=1e9, travel=travel)
    assert answer.decides
    assert answer.limits.seconds > usual
    assert not simgap.next_record(data, seed=5, input_range=span, rate=1e9, travel=travel, seconds=usual).decides


def test_the_record_keeps_the_limits(answer):
    u, reach = answer.u[:, 0], answer.design.reach
    assert u.shape == (60,)
    assert u.min() >= -4.0 and u.max() <= 3.0
    assert np.abs(np.diff(u)).max() <= 30.0 * 0.1 * (1 + 1e-9)
    assert reach[0, 0] >= -1.5 and reach[1, 0] <= 1.6


def test_the_same_seed_designs_the_same_record(answer):
    again = best_record(answer.questions, answer.limits, 0)
    assert (again.u == answer.u).all()


def test_limits_that_nobody_gives_are_those_of_the_training_records(data):
    limits = limits_of(data)
    train = (*data.training.train, *data.training.valid)
    assert limits.low[0] == min(x.u.min() for x in train)
    assert limits.travel_high[0] == max(x.y.max() for x in train)
    assert limits.samples == len(train[0])
    assert limits.relaxed()["travel"].travel_high[0] > limits.travel_high[0]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"input_range": (3.0, -4.0)}, "lower limit first"),
        ({"travel": {"w": (0.0, 1.0)}}, "no column 'w'"),
        ({"rate": 0.0}, "finite number above zero"),
        ({"seconds": 0.5}, "a record needs 40 samples"),
    ],
)
def test_limits_that_make_no_sense_are_refused_in_a_sentence(data, given, sentence):
    with pytest.raises(UnusableInput, match=sentence):
        limits_of(data, **given)


def test_a_mass_against_a_gain_without_a_known_force_is_what_no_record_can_tell(tmp_path):
    stage = hide("stage", {}, seed=0)
    few = replace(stage.training, train=stage.training.train[:2], valid=stage.training.valid[:1])
    answer = simgap.next_record(
        replace(stage, training=few, sha256=""), known={"mass": {"low": "0.5 kg", "high": "2 kg"}}
    )
    said = " ".join(str(answer).split())
    assert "do not tell mass 0.5, gain" in said
    assert "No record can: they simulate the same under every input" in said
    assert "gain over inertia, and nothing else" in said
    assert not answer.helps


def test_the_command_writes_a_record_with_the_columns_of_the_data(data, tmp_path, capsys):
    simgap.save(data, tmp_path / "cart")
    out, found = tmp_path / "next.csv", tmp_path / "next.json"
    options = ["--input-range", "-4,3", "--rate", "30", "--seconds", "6", "--travel", "v=-1.5,1.6"]
    assert main(["next", str(tmp_path / "cart"), *options, "--out", str(out), "--json", str(found)]) == 0
    assert "a dead zone of the actuator" in " ".join(capsys.readouterr().out.split())
    header, *rows = csv.reader(out.read_text().splitlines())
    assert header == ["t", "force"]
    assert len(rows) == 60
    assert float(rows[1][0]) == pytest.approx(0.1)
    about = json.loads(found.read_text())
    assert about["schema"] == 1 and about["decides"]
    assert about["limits"]["input_range"]["force"] == [-4.0, 3.0]


@pytest.mark.parametrize(
    "option", [["--travel", "1"], ["--rate", "a"], ["--input-range", "1,2", "--input-range", "3,4"]]
)
def test_the_command_refuses_limits_that_are_no_numbers(option, data, tmp_path, capsys):
    simgap.save(data, tmp_path / "cart")
    code = main(["next", str(tmp_path / "cart"), *option])
    assert (code, capsys.readouterr().err.count("\n")) == (2, 1)


def test_a_record_of_a_controller_gets_no_design(data):
    follows = [replace(x, u=-2.0 * x.y) for x in (*data.training.train, *data.training.valid)]
    training = replace(data.training, train=tuple(follows[:2]), valid=tuple(follows[2:]))
    answer = simgap.next_record(replace(data, training=training, sha256=""))
    assert "shows the controller" in " ".join(str(answer).split())
    assert answer.design is None


@pytest.mark.parametrize(
    ("limits", "complaint"),
    [
        ({"seconds": 1e6}, "a record may have 100000 samples at most"),
        ({"rate": {"load": 3.0}}, "'load' does not move within a record"),
    ],
)
def test_limits_that_no_record_can_keep_are_refused(limits, complaint):
    u = np.column_stack((np.sin(np.arange(100)), np.full(100, 2.0)))
    train, test = ((Experiment(name, u, np.cumsum(u[:, :1], axis=0), 0.1),) for name in ("train", "test"))
    channels = Channels((Channel("u", "V"), Channel("load", "kg")), (Channel("y", "m"),))
    data = Dataset("cart", TrainingSet(train, (), 5, channels), test, 5, channels)
    with pytest.raises(UnusableInput, match=complaint):
        limits_of(data, **limits)


def test_a_column_with_a_comma_in_its_name_can_be_read_again(answer, tmp_path):
    channels = replace(answer.channels, inputs=(replace(answer.channels.inputs[0], name="Voltage, V"),))
    replace(answer, channels=channels).write(tmp_path / "next.csv")
    with (tmp_path / "next.csv").open() as file:
        assert next(csv.reader(file)) == ["t", "Voltage, V"]
