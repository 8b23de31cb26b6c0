"""The summary of a data set: its counts add up and it can be written as JSON."""

import json

import pytest

from simgap.data import describe, load


def test_a_description_counts_what_is_there(good):
    data = load(good)
    facts = describe(data)
    assert json.loads(json.dumps(facts)) == facts
    assert facts["sampling_time"] == 0.1
    assert facts["splits"]["train"] == {
        "experiments": 2,
        "samples": 40,
        "shortest": 20,
        "longest": 20,
        "names": ["000", "001"],
    }
    assert facts["inputs"][0]["name"] == "u"
    assert facts["outputs"][0]["kind"] == "position"
    low, high = facts["outputs"][0]["low"], facts["outputs"][0]["high"]
    assert low == min(e.y.min() for e in data.training.train)
    assert high == max(e.y.max() for e in data.training.train)


def test_the_spread_is_that_of_the_training_split_only(good):
    before = describe(load(good))
    file = good / "test" / "003.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:-1], "1.9,1000,1000"]))
    after = describe(load(good))
    assert after["inputs"] == before["inputs"]
    assert after["outputs"] == before["outputs"]
    assert after["sha256"] != before["sha256"]


def test_a_set_without_validation_is_described_too(good):
    data = load(good)
    object.__setattr__(data.training, "valid", ())
    assert describe(data)["splits"]["valid"]["samples"] == pytest.approx(0)
