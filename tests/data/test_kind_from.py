"""Who says the kind of an output: a channel remembers it, files keep it, digests and equality ignore it."""

from dataclasses import replace

import pytest

from simgap.data import load, save
from simgap.data.loading import read
from simgap.records import Channel, Channels, Dataset
from simgap.registry import DATASETS


def test_a_channel_in_python_is_written_unless_its_kind_is_left_out():
    assert Channel("y", "deg", "position").kind_from == "written"
    assert Channel("y", kind="other").kind_from == "written"
    assert (Channel("y").kind, Channel("y").kind_from) == ("other", "unknown")


def test_a_changed_channel_keeps_who_knows_its_kind():
    assert replace(Channel("y"), name="z").kind_from == "unknown"
    assert replace(Channel("y", kind="level"), name="z").kind_from == "written"


def test_channels_are_equal_whoever_knows_their_kind():
    assert Channel("y") == Channel("y", kind="other")
    assert hash(Channel("y")) == hash(Channel("y", kind="other"))


def with_output(data: Dataset, channel: Channel) -> Dataset:
    channels = Channels(data.channels.inputs, (channel,))
    return replace(data, training=replace(data.training, channels=channels), channels=channels, sha256="")


@pytest.mark.parametrize("kind_from", ["written", "header", "option"])
@pytest.mark.parametrize("kind", ["velocity", "other"])
def test_who_knows_a_kind_survives_saving(good, tmp_path, kind, kind_from):
    data = with_output(load(good), Channel("phi", "deg", kind, kind_from))
    save(data, tmp_path / "set")
    again = load(tmp_path / "set")
    assert (again.channels.outputs[0].kind, again.channels.outputs[0].kind_from) == (kind, kind_from)
    assert again.sha256 == data.sha256 == load(good).sha256


def test_an_unknown_kind_survives_saving(good, tmp_path):
    save(with_output(load(good), Channel("phi", "")), tmp_path / "set")
    assert "kind" not in (tmp_path / "set" / "dataset.toml").read_text()
    assert load(tmp_path / "set").channels.outputs[0].kind_from == "unknown"


def test_a_kind_left_out_of_a_card_is_told_by_name_and_unit_or_unknown_and_one_that_is_there_is_written(good):
    assert load(good).channels.outputs[0].kind_from == "written"
    card = good / "dataset.toml"
    card.write_text(card.read_text().replace('kind = "position"', ""))
    output = load(good).channels.outputs[0]
    assert (output.kind, output.kind_from) == ("position", "header")  # phi in deg
    assert read(good).said == ("phi as position (deg, by name and unit)",)
    card.write_text(card.read_text().replace('unit = "deg"', ""))
    assert load(good).channels.outputs[0].kind_from == "unknown"
    card.write_text(card.read_text().replace('name = "phi"', 'name = "phi"\nkind = "other"'))
    assert load(good).channels.outputs[0].kind_from == "written"


@pytest.mark.parametrize("line", ['kind_from = "unknown"', "kind_from = 3", 'kind_from = ["header"]'])
def test_a_wrong_source_of_a_kind_is_refused(good, refused, line):
    card = good / "dataset.toml"
    card.write_text(card.read_text().replace('kind = "position"', f'kind = "position"\n{line}'))
    assert "header or option can stand beside a kind" in refused(good)


@pytest.mark.parametrize("name", DATASETS.names())
def test_the_card_of_a_registered_data_set_writes_every_kind(name, measured, monkeypatch):
    try:
        data = load(name)
    except ValueError as missing:
        pytest.skip(str(missing))
    assert {channel.kind_from for channel in data.channels.outputs} == {"written"}
