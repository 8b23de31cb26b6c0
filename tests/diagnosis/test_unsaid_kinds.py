"""A card that is left out: the records decide what an output is, and the answer stays what it was with the card."""

import csv

import pytest

from simgap.data import load
from simgap.data.simulated.rigs import RIGS, hide, suitable
from simgap.diagnosis.diagnose import diagnose
from simgap.records import Channel, Channels

# Only who knows what the output is can name these: another kind of plant does the same without them. Of a position with
# its velocity the readings tell the kinds.
KNOWN_BY_THE_CARD = ("actuator_lag", "sensor_lag", "constant_load")
# A position on a spring with another bias in each record may as well be a number that settles elsewhere in each; one
# that swings may be disturbed periodically, and one that integrates behind a delay be of third order.
ASKED = {
    ("stage", "sensor_bias"): "as a position it has sensor bias",
    ("stage", "periodic_disturbance"): "as a position it has a periodic disturbance",
    ("arm", "input_delay"): "as a position it has input delay",
}
YOUNG = ("load_drift", "limited_braking")
CASES = [
    (rig, effect)
    for rig in RIGS
    for effect in ("", *suitable(rig))
    if (rig, effect) != ("cart", "coulomb_friction") and (rig == "slide" or effect not in KNOWN_BY_THE_CARD)
]


def without_card(data):
    """The same records with columns called u and y."""
    outputs = tuple(Channel(f"y{i}", c.unit) for i, c in enumerate(data.channels.outputs))
    channels = Channels((Channel("u"),), outputs)
    return data.with_channels(channels)


def told(answer):
    return answer.verdict, [cause.effect for cause in answer.findings.effects][:1]


# Every third case, those of the youngest effects last, so that the others stay the same ones.
OLD = [case for case in CASES if case[1] not in YOUNG]
IN_ORDER = [*OLD, *((rig, effect) for effect in YOUNG for rig in RIGS if (rig, effect) in CASES)]
SAMPLE = [case for case in IN_ORDER[::3] if case not in ASKED]


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "effect"), SAMPLE)
def test_a_card_left_out_changes_neither_verdict_nor_first_name(rig, effect):
    data = hide(rig, {effect: 1.0} if effect else {}, 0.05, seed=7)
    assert told(diagnose(without_card(data), views_too=False)) == told(diagnose(data, views_too=False))


@pytest.mark.slow
def test_a_file_with_meaningless_headings_gets_the_answer_that_it_gets_where_the_kind_is_said(tmp_path):
    data = hide("cart", {"coulomb_friction": 1.0}, 0.05, seed=7)
    with (tmp_path / "motor.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["u", "y"])
        for x in data.training.train:
            rows.writerows([*u, *y] for u, y in zip(x.u, x.y, strict=True))
    flat = load(tmp_path / "motor.csv", ["u"], ["y"], dt=data.training.dt)
    assert flat.channels.outputs[0].kind_from == "unknown"
    answer = diagnose(flat, views_too=False)
    assert told(answer) == told(diagnose(flat, views_too=False, kind="velocity"))
    assert told(answer)[1] == ["coulomb_friction"]
    assert "y is taken as a velocity" in " ".join(str(answer).split())
    assert answer.to_json()["kinds"] == {"y": {"kind": "velocity", "from": "evidence"}}


@pytest.mark.slow
def test_a_kind_that_is_said_is_not_asked_of_the_records():
    data = hide("cart", {"coulomb_friction": 1.0}, 0.05, seed=7)
    answer = diagnose(without_card(data), views_too=False, kind="other")
    assert answer.to_json()["kinds"] == {"y0": {"kind": "other", "from": "option"}}
    assert not any("is taken as" in check for check in answer.findings.checks)


@pytest.mark.parametrize(
    ("rig", "effect", "known"),
    [
        ("cart", "actuator_lag", "as a velocity it has actuator lag"),
        *[pytest.param(*case, known, marks=pytest.mark.slow) for case, known in ASKED.items()],
    ],
)
def test_where_the_name_hangs_on_the_kind_the_first_sentence_asks_for_it(rig, effect, known):
    answer = diagnose(without_card(hide(rig, {effect: 1.0}, 0.05, seed=7)), views_too=False)
    assert answer.verdict == "nothing_found"
    assert answer.findings.doubts[0].startswith("What y0 is decides the answer")
    assert known in answer.findings.doubts[0]
