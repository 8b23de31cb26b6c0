"""A simulation that shares no code with simgap is diagnosed: what it lacks, what it has wrong, and what that costs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from their_simulations import draw, first_name_is_right, simulation

import simgap
from simgap.app.orders import Settings
from simgap.app.reading import dataset_of
from simgap.cli import main
from simgap.data import read
from simgap.data.simulated.rigs import hide
from simgap.diagnosis.diagnose import diagnose
from simgap.records import UnusableInput


def record(rig, effects, seed, noise=0.05):
    """A rig with effects, in half of the usual experiments."""
    data = hide(rig, effects, noise=noise, seed=seed)
    training = replace(data.training, train=data.training.train[:4], valid=data.training.valid[:2])
    return replace(data, training=training, test=data.test[:2], sha256="")


@pytest.fixture(scope="module")
def stage():
    """A stage with friction and a stiffening spring."""
    return record("stage", {"coulomb_friction": 0.5, "cubic_stiffness": 0.5}, 4, noise=0.03)


@pytest.fixture(scope="module")
def answer(stage):
    """Of a simulation without the friction, with a spring twice as stiffening, less gain and more damping."""
    return diagnose(stage, simulated=simulation(stage, "stage", {"cubic_stiffness": 1.0}, 0.85))


def test_an_effect_that_it_lacks_and_one_of_another_size_are_named_with_its_own_numbers(answer):
    causes = {cause.effect: cause for cause in answer.causes}
    assert answer.verdict == "named"
    assert set(causes) == {"coulomb_friction", "cubic_stiffness"}
    assert (causes["coulomb_friction"].holds, causes["coulomb_friction"].simulated) == ("missing", {})
    assert causes["cubic_stiffness"].holds == "other size"
    assert causes["cubic_stiffness"].simulated["stiffness"] == pytest.approx(0.3, rel=0.02)
    assert causes["cubic_stiffness"].parameters[0].value == pytest.approx(0.15, rel=0.03)


def test_wrong_numbers_of_its_linear_part_stand_beside_those_of_the_machine(answer):
    numbers = {number.name: number for number in answer.findings.simulation.linear}
    assert answer.findings.simulation.linear_differs
    assert numbers["gain of u"].value == pytest.approx(50.0, rel=0.01)
    assert numbers["gain of u"].simulated == pytest.approx(42.5, rel=0.01)
    assert numbers["damping over inertia"].simulated == pytest.approx(4.0 / 0.85, rel=0.01)
    assert numbers["stiffness over inertia"].simulated == pytest.approx(25.0, rel=0.01)


def test_its_errors_are_those_of_the_columns_and_the_budget_divides_them(answer, stage):
    simulated = simulation(stage, "stage", {"cubic_stiffness": 1.0}, 0.85)
    e = np.concatenate([x.y[20:] - z.y[20:] for x, z in zip(stage.test, simulated.test, strict=True)])
    said = answer.findings.simulation.errors["x"]["test"]
    assert said == pytest.approx({"rmse": np.sqrt(np.mean(e**2)), "mae": np.mean(np.abs(e))})
    assert answer.findings.gain.before["x"] == pytest.approx(said["rmse"])
    assert answer.findings.gain.low > 0.8
    (budget,) = answer.findings.budget
    assert set(budget.causes) == {"coulomb_friction", "cubic_stiffness", "linear_part"}
    assert sum(budget.causes.values()) + budget.learnable + budget.unexplained == pytest.approx(1.0)
    assert sum(budget.causes.values()) == pytest.approx(1 - (1 - answer.findings.gain.share) ** 2, abs=1e-6)


def test_text_page_and_json_speak_of_the_users_simulation(answer):
    text, page = str(answer), answer.to_html()
    assert "Your simulation errs because of" in text
    assert "Your simulation does not have it." in text
    assert "in your simulation 42.5" in text
    assert "plain model" not in text and "plain linear" not in text
    assert "your simulation" in page
    written = json.loads(json.dumps(answer.to_json(), allow_nan=False))
    assert written["simulation"]["linear_differs"]
    assert {cause["holds"] for cause in written["causes"]} == {"missing", "other size"}


def test_a_right_simulation_lacks_nothing():
    dataset = record("cart", {"dead_zone": 1.0}, 2)
    right = diagnose(dataset, simulated=simulation(dataset, "cart", {"dead_zone": 1.0}), views_too=False)
    assert (right.verdict, right.causes) == ("nothing_found", ())


@pytest.mark.slow
def test_a_simulation_with_nothing_but_wrong_numbers_in_its_linear_part_is_told_so():
    dataset = record("cart", {"dead_zone": 1.0}, 2)
    wrong = diagnose(dataset, simulated=simulation(dataset, "cart", {"dead_zone": 1.0}, 0.8), views_too=False)
    assert (wrong.verdict, wrong.causes) == ("nothing_found", ())
    assert wrong.findings.simulation.linear_differs
    assert "parameters of its linear part are not those of the machine" in " ".join(str(wrong).split())


def test_a_record_in_the_place_of_its_simulation_lacks_nothing():
    dataset = record("cart", {}, 2)
    answer = diagnose(dataset, simulated=dataset)
    assert (answer.verdict, answer.causes) == ("nothing_found", ())
    assert answer.findings.simulation.errors["v"]["test"] == {"rmse": 0.0, "mae": 0.0}
    assert answer.to_json()["budget"]["v"]["unexplained"] is None


@pytest.mark.slow
def test_an_effect_that_only_the_simulation_has_is_named_as_that():
    dataset = record("cart", {"coulomb_friction": 1.0}, 3)
    answer = diagnose(dataset, simulated=simulation(dataset, "cart", {"quadratic_drag": 1.0}), views_too=False)
    holds = {cause.effect: cause.holds for cause in answer.causes}
    assert holds == {"coulomb_friction": "missing", "quadratic_drag": "not in the machine"}


@pytest.mark.slow
def test_nineteen_of_twenty_first_names_are_what_an_independent_simulation_lacks():
    answers = {str(draw(number)): first_name_is_right(draw(number)) for number in range(20)}
    wrong = [f"{case}: {said}" for case, (right, said) in answers.items() if not right]
    assert len(wrong) <= 1, wrong


@pytest.fixture
def log(tmp_path):
    """A CSV file with u, y and y_sim: a first-order plant with a dead zone, and its simulation without."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, 120), 10)
    y, y_sim = np.zeros((2, len(u)))
    for k in range(1, len(u)):
        pushed = max(u[k - 1] - 0.3, 0) + min(u[k - 1] + 0.3, 0)
        y[k] = 0.9 * y[k - 1] + 0.2 * pushed
        y_sim[k] = 0.9 * y_sim[k - 1] + 0.2 * u[k - 1]
    y += 0.02 * rng.standard_normal(len(u))
    table = np.column_stack((0.1 * np.arange(len(u)), u, y, y_sim))
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="t,u,y (m/s),y_sim (m/s)", comments="")
    return tmp_path / "log.csv"


def test_the_command_reads_the_simulation_from_a_column(log, tmp_path, capsys):
    said = ["diagnose", str(log), "--input", "u", "--output", "y", "--simulated", "y_sim"]
    assert main([*said, "--json", str(tmp_path / "a.json")]) == 0
    assert "Your simulation errs because of a dead zone" in " ".join(capsys.readouterr().out.split())
    written = json.loads((tmp_path / "a.json").read_text())
    assert [cause["effect"] for cause in written["causes"]] == ["dead_zone"]
    assert set(written["simulation"]["errors"]) == {"y"}


def test_a_folder_may_hold_the_column_whether_its_toml_names_it_or_not(log, tmp_path, stage):
    simgap.save(stage, str(tmp_path / "folder"))
    simulated = simulation(stage, "stage", {})
    for split, runs in (("train", simulated.training.train), ("valid", simulated.training.valid),
                        ("test", simulated.test)):  # fmt: skip
        for run in runs:
            file = tmp_path / "folder" / split / f"{run.name}.csv"
            lines = file.read_text().splitlines()
            rows = [f"{line},{value!r}" for line, value in zip(lines[1:], run.y[:, 0].tolist(), strict=True)]
            file.write_text("\n".join([f"{lines[0]},x_sim", *rows]))
    from simgap.data.loading import read

    unnamed = read(str(tmp_path / "folder"), simulated=["x_sim"])
    toml = tmp_path / "folder" / "dataset.toml"
    named = '[[outputs]]\nname = "x_sim"\nunit = "mm"\nkind = "position"\n\n[splits]'
    toml.write_text(toml.read_text().replace("[splits]", named))
    for reading in (unnamed, read(str(tmp_path / "folder"), simulated=["x_sim"])):
        assert [channel.name for channel in reading.dataset.channels.outputs] == ["x"]
        assert np.allclose(reading.simulated.test[0].y, simulated.test[0].y)
        assert np.allclose(reading.dataset.test[0].y, stage.test[0].y)


def test_a_simulated_column_may_be_named_by_its_whole_heading_and_get_a_unit_on_the_page(log):
    assert read(str(log), ["u"], ["y"], simulated=["y_sim (m/s)"]).simulated is not None
    log.write_text(log.read_text().replace("y (m/s)", "y", 1))
    settings = Settings(["u"], ["y"], ["y_sim (m/s)"], units={"y": "m/s"})
    assert dataset_of(str(log), settings).simulated.channels.outputs[0].unit == "m/s"


@pytest.mark.parametrize(
    ("columns", "complaint"),
    [
        (["nothing"], "no column 'nothing'"),
        (["y_sim", "u2"], "2 simulated columns for 1 measured outputs"),
        (["volts"], "is simulated in V and y measured in m/s"),
    ],
)
def test_columns_that_are_no_simulation_are_refused_in_a_sentence(log, columns, complaint):
    lines = log.read_text().splitlines()
    rows = [f"{line},{i % 7},{i % 5}" for i, line in enumerate(lines[1:])]
    log.write_text("\n".join([f"{lines[0]},u2,volts (V)", *rows]))
    with pytest.raises(UnusableInput, match=complaint):
        diagnose(str(log), inputs=["u"], outputs=["y"], simulated=columns)


def test_a_simulation_of_other_experiments_is_refused(stage):
    with pytest.raises(UnusableInput, match="training experiments are not simulations of those"):
        diagnose(stage, simulated=record("stage", {}, 5))
