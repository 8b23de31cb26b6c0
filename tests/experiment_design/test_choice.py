"""`simgap next --among`: records that could be taken are ranked by how well all of them could be simulated."""

import json
from dataclasses import replace

import numpy as np
import pytest
from choice_study import of_runs

import simgap
from simgap.cli import main
from simgap.data.formats.plant_table import with_known
from simgap.data.measured.servo_sts3215 import PLANT
from simgap.data.simulated.rigs import hide
from simgap.experiment_design.choice import ranked
from simgap.greybox.fitting import descend
from simgap.greybox.identification import identify
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator
from simgap.records import Experiment, UnusableInput


@pytest.fixture(scope="module")
def data():
    """Two records of a cart with dry friction."""
    data = hide("cart", {"coulomb_friction": 0.5}, noise=0.02, seed=1)
    return replace(data, training=replace(data.training, train=data.training.train[:2], valid=()))


@pytest.fixture(scope="module")
def candidates(data):
    """Nothing, a weak and a strong switching input, and one of those at hand."""
    samples, size = len(data.training.train[0]), np.abs(data.training.train[0].u).max()
    switching = np.where(np.random.default_rng(0).random((samples, 1)) < 0.05, -1.0, 1.0).cumprod(axis=0)
    at_hand = data.training.train[1].u
    return {"nothing": 0 * switching, "weak": 0.1 * size * switching, "strong": size * switching, "at hand": at_hand}


@pytest.fixture(scope="module")
def identified(data):
    return identify(data.training)


@pytest.fixture(scope="module")
def choice(data, identified, candidates):
    return ranked(data, identified, candidates)


def test_the_record_that_moves_most_is_the_best_and_one_below_dry_friction_tells_as_little_as_none(choice):
    assert choice.best == "strong"
    assert 0 < choice.left[0] < 0.5
    assert choice.left[1:] == pytest.approx((1.0, 1.0), abs=0.01)


def test_what_is_at_hand_is_not_ranked(choice):
    assert choice.taken == ("at hand",)
    assert len(choice.names) == 3


def test_the_answer_names_record_effects_and_what_it_does_not_count(choice):
    text = " ".join(str(choice).split())
    assert "Take strong next" in text
    assert "Coulomb friction" in text
    assert "1 candidate has the inputs of an existing record: left out." in text
    assert "What the model lacks is not counted" in text


def test_what_is_left_is_what_fits_to_drawn_noise_leave(data, identified, candidates, choice):
    """The mean square over the candidates of simulations after either record, 60 draws."""
    fitted = identified[0].plant
    plant, noise, theta = fitted.forecast.plant, fitted.noise, fitted.forecast.theta
    assert all(np.allclose(polynomial, [1.0]) for polynomial in noise.polynomials), "white noise is drawn below"
    rng, dt = np.random.default_rng(3), data.training.dt

    def simulated(u, theta):
        return Simulator(plant, u).run(theta, np.zeros((len(u), plant.n_local)))

    of_all = np.stack(list(candidates.values()))

    def error_after(name):
        u = np.stack([*(x.u for x in data.training.train), candidates[name]])
        exact, squares = simulated(u, theta), []
        for _ in range(60):
            y = exact + noise.deviations * rng.standard_normal(exact.shape)
            problem = Problem(plant, Records.measured(u, y, dt), noise)
            fit = descend(problem, theta, np.zeros((len(u), plant.n_local)))
            squares.append(np.mean((simulated(of_all, fit.theta) - simulated(of_all, theta)) ** 2))
        return np.mean(squares)

    left = dict(zip(choice.names, choice.left, strict=True))
    assert error_after("strong") / error_after("nothing") == pytest.approx(left["strong"] / left["nothing"], rel=0.5)


def test_outputs_of_candidates_are_not_read(tmp_path, capsys):
    t = np.arange(300) * 0.1
    rng = np.random.default_rng(2)
    u = np.where(rng.random(300) < 0.05, -1.0, 1.0).cumprod()
    y = np.zeros(300)
    for k in range(299):
        y[k + 1] = 0.9 * y[k] + 0.1 * u[k]
    rows = np.column_stack((t, u, y + 0.01 * rng.standard_normal(300)))
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t,u,y", comments="")
    folder = tmp_path / "runs"
    folder.mkdir()
    for name, size in (("calm", 0.01), ("lively", 3.0)):
        cells = [f"{a:.1f},{size * b},soon" for a, b in zip(t, np.roll(u, 7), strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["t,u,y", *cells]) + "\n")
    log, out = str(tmp_path / "log.csv"), tmp_path / "answer.json"
    arguments = ["next", log, "--input", "u", "--output", "y", "--kind", "other"]
    assert main([*arguments, "--among", str(folder), "--json", str(out)]) == 0
    assert "Take lively next" in capsys.readouterr().out
    answer = json.loads(out.read_text())
    assert [one["name"] for one in answer["candidates"]] == ["lively", "calm"]
    assert main([*arguments, "--among", str(folder / "calm.csv")]) == 0


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({}, "holds no file"),
        ({"a.csv": "t,v\n0,1\n0.1,2\n"}, "no column 'force'"),
        ({"a.csv": "t,force\n0,1\n0.5,2\n"}, "0.5"),
        ({"a.csv": "t,force\n0,1\n0.1,\n"}, "row 3"),
        ({"a.csv": "force\n1\n"}, "two samples or more"),
        ({"a.csv": "force\n1\n2\n", "a.txt": "force\n1\n3\n"}, "rename one"),
    ],
)
def test_a_bad_candidate_gets_one_sentence(tmp_path, data, identified, files, reason):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(UnusableInput, match=reason):
        simgap.choose_record(data, tmp_path)


def test_of_records_that_show_the_controller_nothing_is_ranked(data, candidates):
    train = tuple(Experiment(x.name, 5.0 - x.y, x.y, x.dt) for x in data.training.train)
    under_control = replace(data, training=replace(data.training, train=train))
    with pytest.raises(UnusableInput, match="shows the controller"):
        simgap.choose_record(under_control, candidates)


def test_where_nothing_is_new_the_answer_says_so(data, identified):
    with pytest.raises(UnusableInput, match="no candidate whose inputs are not"):
        ranked(data, identified, {"again": data.training.train[0].u})


def test_limits_are_refused_beside_candidates(tmp_path, capsys):
    assert main(["next", "daisy_hairdryer", "--among", str(tmp_path), "--seconds", "3"]) == 2
    assert "leave out limits" in capsys.readouterr().err


@pytest.mark.slow
def test_a_few_runs_of_a_measured_servo_show_that_its_rate_is_limited_and_that_it_has_friction(measured):
    """Beside a limited rate alone, a force of one run stood in the way of all that acts in every run."""
    folder = measured / "measured" / "servo_sts3215"
    if not folder.is_dir():
        pytest.skip("servo_sts3215 is not at hand")
    runs = [
        "sin_sin_kp24_m0.74_l0.1", "lift_and_drop_kp8_m1.17_l0.15", "lift_and_drop_kp4_m0.54_l0.15",
        "sin_time_square_kp8_m0.54_l0.15", "lift_and_drop_kp32_m0.74_l0.1", "sin_time_square_kp32_m1.17_l0.15",
        "lift_and_drop_kp4_m0.74_l0.15", "sin_time_square_kp32_m0.54_l0.15", "brutal_kp4_m1.17_l0.15",
        "sin_time_square_kp16_m0.54_l0.1", "brutal_kp24_m1.17_l0.15", "lift_and_drop_kp4_m0.54_l0.1",
    ]  # fmt: skip
    (found,) = identify(of_runs(with_known(simgap.load(folder), PLANT), runs).training)
    effects = {term.effect.name for term in found.plant.estimate.plant.terms}
    assert "rate_limit" in effects
    assert effects & {"coulomb_friction", "load_friction", "stribeck_friction"}
