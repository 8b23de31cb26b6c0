"""A saved model on other records: the figures of the fit, a CSV file, and what is refused."""

import csv
import json

import numpy as np
import pytest

import simgap
from simgap.cli import main
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet, UnusableInput
from simgap.saved.archive import save_model

U, Y = Channel("u", "V"), Channel("phi", "deg")
CHANNELS = Channels((U,), (Y,))


def record(name, seed, samples=200, dt=0.1):
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal((samples, 1)), np.zeros((samples, 1))
    for t in range(1, samples):
        y[t] = 0.9 * y[t - 1] + 0.2 * u[t - 1]
    return Experiment(name, u, y + 0.01 * rng.standard_normal(y.shape), dt)


def lag(channels=CHANNELS):
    """A first-order plant with two test experiments."""
    training = TrainingSet((record("a", 0),), (record("b", 1),), 5, channels)
    return Dataset("lag", training, (record("c", 2), record("d", 3)), 5, channels)


def write(path, header, columns):
    np.savetxt(path, np.column_stack(columns), fmt="%.17g", delimiter=",", header=header, comments="")
    return path


def csv_of(path, x, header="t,u,phi"):
    return write(path, header, (x.dt * np.arange(len(x)), x.u, x.y))


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """An ARX model, on disk, with the results of its fit."""
    file = tmp_path_factory.mktemp("saved") / "arx.simgap"
    done = simgap.fit("arx", lag(), {"na": 1, "nb": 1})
    save_model(done.model, file, lag())
    return file, done


def test_on_the_test_experiments_it_has_the_figures_of_the_fit(saved):
    file, done = saved
    runs = simgap.simulate(file, lag())
    fitted = {result.experiment: result.metrics for result in done.results if result.task == "free_run"}
    assert {run.experiment.name: run.metrics for run in runs} == fitted


def test_a_file_is_simulated_as_a_whole(saved, tmp_path):
    x = record("x", 7)
    (run,) = simgap.simulate(saved[0], csv_of(tmp_path / "x.csv", x))
    np.testing.assert_array_equal(run.y_hat, saved[1].model.simulate(x.u[None], x.y[None, :5])[0])
    assert len(run.y_hat) == 195
    frame = pytest.importorskip("pandas").read_csv(tmp_path / "x.csv")
    (of_frame,) = simgap.simulate(saved[0], frame)
    np.testing.assert_array_equal(of_frame.y_hat, run.y_hat)


def test_an_input_that_stands_still_is_simulated_too(saved, tmp_path):
    x = record("x", 7)
    (run,) = simgap.simulate(saved[0], csv_of(tmp_path / "x.csv", Experiment("x", 0 * x.u, x.y, x.dt)))
    assert run.metrics["phi"]["n_scored"] == 195


def test_one_experiment_is_chosen_by_its_name(saved):
    for name in ("d", "a"):
        (run,) = simgap.simulate(saved[0], lag(), experiment=name)
        assert run.experiment.name == name
    with pytest.raises(UnusableInput, match="there is no experiment 'z'; there are c, d, b, a"):
        simgap.simulate(saved[0], lag(), experiment="z")


def test_the_csv_file_holds_time_inputs_measured_and_simulated_outputs(saved, tmp_path):
    (run,) = simgap.simulate(saved[0], lag(), experiment="c")
    run.write(tmp_path / "run.csv")
    header, *rows = csv.reader((tmp_path / "run.csv").read_text().splitlines())
    assert header == ["time", "u", "phi", "phi_simulated"]
    assert [row[0] for row in rows[:4]] == ["0", "0.1", "0.2", "0.3"]
    assert [row[3] for row in rows[:5]] == [""] * 5
    np.testing.assert_array_equal([float(row[3]) for row in rows[5:]], run.y_hat[:, 0])
    np.testing.assert_array_equal([float(row[2]) for row in rows], run.experiment.y[:, 0])
    again = simgap.fit("arx", tmp_path / "run.csv", {"na": 1, "nb": 1}, inputs=["u"], outputs=["phi"])
    assert again.results[0].status == "ok"


@pytest.mark.parametrize(
    ("header", "dt", "wrong"),
    [
        ("t,v,phi", 0.1, "x.csv has no column 'u', which the model was fitted on; there are 't', 'v', 'phi'"),
        ("t,u,psi", 0.1, "x.csv has no column 'phi', which the model was fitted on"),
        ("t,u [mV],phi", 0.1, "u is in mV, the model was fitted on V; convert the column"),
        ("t,u,phi [rad]", 0.1, "phi is in rad, the model was fitted on deg; convert the column"),
        ("t,u,phi", 0.2, "sampled every 0.2 s, the model was fitted on 0.1 s; resample the data"),
    ],
)
def test_other_columns_units_and_sampling_times_are_refused_in_one_sentence(saved, tmp_path, capsys, header, dt, wrong):
    file = csv_of(tmp_path / "x.csv", record("x", 7, dt=dt), header)
    assert main(["simulate", str(saved[0]), str(file)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert wrong in err


@pytest.mark.parametrize(
    ("channels", "wrong"),
    [
        (Channels((Channel("i", "A"),), (Y,)), "the inputs are i, the model was fitted on u"),
        (Channels((U,), (Channel("psi", "deg"),)), "the outputs are psi, the model was fitted on phi"),
        (Channels((Channel("u", "A"),), (Y,)), "u is in A, the model was fitted on V"),
    ],
)
def test_a_data_set_of_another_machine_is_refused(saved, channels, wrong):
    with pytest.raises(UnusableInput, match=wrong):
        simgap.simulate(saved[0], lag(channels))


def test_a_unit_that_nobody_wrote_and_another_way_to_write_it_are_the_same(saved):
    given = Channels((Channel("u"),), (Channel("phi", "°"),))
    assert len(simgap.simulate(saved[0], lag(given))) == 2


def test_a_record_that_is_too_short_is_refused(saved, tmp_path):
    with pytest.raises(UnusableInput, match="has 5 samples, of which n_init = 5 start the simulation"):
        simgap.simulate(saved[0], csv_of(tmp_path / "x.csv", record("x", 7, samples=5)))


def test_the_command_prints_the_figures_and_writes_the_file(saved, tmp_path, capsys):
    data, out, figures = csv_of(tmp_path / "x.csv", record("x", 7)), tmp_path / "run.csv", tmp_path / "run.json"
    assert main(["simulate", str(saved[0]), str(data), "--out", str(out), "--json", str(figures)]) == 0
    said = capsys.readouterr().out
    assert "arx, fitted on lag; each simulation starts from n_init = 5 samples" in said
    assert "RMSE" in said
    assert "deg" in said
    assert len(out.read_text().splitlines()) == 201
    (written,) = json.loads(figures.read_text())["simulations"]
    assert written["metrics"] == simgap.simulate(saved[0], data)[0].metrics


def test_one_file_takes_one_experiment(saved, tmp_path, capsys):
    simgap.save(lag(), tmp_path / "lag")
    command = ["simulate", str(saved[0]), str(tmp_path / "lag"), "--out", str(tmp_path / "run.csv")]
    assert main(command) == 2
    assert "a file takes one experiment; choose it with --experiment: c, d" in capsys.readouterr().err
    assert main([*command, "--experiment", "d"]) == 0


def test_a_simulation_that_grows_beyond_all_bounds_has_infinite_errors(saved, tmp_path):
    unstable = simgap.load_model(saved[0])
    unstable.polynomial.a[1] = -1e30
    save_model(unstable, tmp_path / "unstable", lag())
    assert simgap.simulate(tmp_path / "unstable", lag())[0].metrics["phi"]["rmse"] == np.inf


def test_what_a_diagnosis_ends_with_is_saved_and_simulates(tmp_path, capsys):
    data = str(csv_of(tmp_path / "x.csv", record("x", 7, samples=600)))
    columns = ["--input", "u", "--output", "phi"]
    saved = str(tmp_path / "plant.simgap")
    assert main(["diagnose", data, *columns, "--save", saved]) == 0
    assert main(["simulate", saved, data]) == 0
    assert "greybox, fitted on x" in capsys.readouterr().out
