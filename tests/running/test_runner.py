import json
import math
import pickle
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from safetensors import safe_open

import simgap
from simgap.data import save
from simgap.records import Dataset, UnusableInput
from simgap.results import store


def by_model(results):
    return {(row.model, row.experiment, row.task): row for row in results}


# What a model does, the status of its rows, and what their message says; the names are those of example_models.py.
MISBEHAVING = {
    "RaisesInFit": ("error", "fit raised RuntimeError: no luck today (example_models.py, line "),
    "RaisesInSimulate": ("error", "simulate raised LinAlgError: singular (example_models.py"),
    "RaisesSpeechless": ("error", "without words, because its __str__ raised ValueError"),
    "RaisesNovels": ("error", "... (500000 characters) (example_models.py"),
    "Leaves": ("error", "SystemExit: 3"),
    "Interrupts": ("error", "fit raised KeyboardInterrupt"),
    "EndsInSimulate": ("error", "simulate raised GeneratorExit"),
    "Dies": ("error", "ended with exit code 3"),
    "Crashes": ("error", "was ended by SIGSEGV"),
    "Leaks": ("error", "MemoryError"),
    "Hangs": ("timeout", "no result after 6 s"),
    "HangsInSimulate": ("timeout", "no result after 6 s"),
    "IsNaN": ("diverged", "grew beyond all bounds or is not a number"),
    "Explodes": ("diverged", "grew beyond all bounds or is not a number"),
    "WrongShape": ("error", "simulate broke the protocol: it returned the shape ("),
    "SinglePrecision": ("error", "it returned float32 values, where float64 was asked for"),
    "IsComplex": ("error", "it returned complex128 values, where float64 was asked for"),
    "IsAList": ("error", "it returned a list, where a NumPy array was asked for"),
    "ChangesInput": ("error", "it changed its argument u in place"),
    "ChangesTraining": ("error", "read-only"),
    "ChangesTheWorld": ("ok", ""),
    "Prints": ("ok", ""),
    "LeavesAThread": ("ok", ""),
    "ChoosesMuch": ("ok", ""),
    "Warns": ("ok", "badly conditioned"),
    "Mean": ("ok", ""),
}


def test_a_model_that_misbehaves_becomes_rows_and_the_others_go_on(suite, tmp_path, capfd):
    # Only those that hang meet the short limit: on a loaded machine any other may take as long.
    hanging = [name for name, (status, _) in MISBEHAVING.items() if status == "timeout"]
    others = [name for name in MISBEHAVING if name not in hanging]
    results = simgap.run(suite(*hanging, timeout=6), out=tmp_path / "out", jobs=2)
    results += simgap.run(suite(*others, timeout=300, memory=1), out=tmp_path / "out", jobs=2)

    assert len(results) == len(MISBEHAVING) * 2 * 2  # models x experiments x tasks
    assert sorted(map(store.key, results)) == sorted(map(store.key, store.read(tmp_path / "out" / "mine")))
    for row in results:
        status, message = MISBEHAVING[row.model]
        assert row.status == status, (row.model, row.message)
        assert message in row.message, row.model
        if row.status != "ok":
            assert all(figures["rmse"] == math.inf for figures in row.metrics.values())
    rows = by_model(results)
    for model in ("Mean", "Prints", "LeavesAThread", "ChangesTheWorld"):
        assert rows[model, "first", "free_run"].message == ""
    assert rows["ChoosesMuch", "first", "free_run"].fitted.keys() == {"left_out"}
    assert capfd.readouterr().out == ""


def test_a_row_says_what_was_scored_how_and_where(suite, tmp_path, dataset):
    row = by_model(simgap.run(suite("Mean"), out=tmp_path / "out"))["Mean", "first", "free_run"]
    assert row.units == {"phi": "deg", "omega": "deg/s"}
    assert row.fitted["seed"] == 0
    assert row.n_params == 2
    assert row.metrics["phi"]["n_scored"] == 86
    assert row.fit_seconds >= 0
    assert row.simulate_seconds >= 0
    names = ("commit", "simgap", "python", "numpy", "scipy", "device", "threads", "platform", "data_sha256")
    assert set(names) <= set(row.provenance)
    assert row.provenance["data_sha256"] == dataset.sha256


def test_each_seed_is_a_fit_of_its_own(suite, tmp_path):
    results = simgap.run(suite("Mean"), seeds=3, out=tmp_path / "out")
    assert sorted({(row.seed, row.fitted["seed"]) for row in results}) == [(0, 0), (1, 1), (2, 2)]


def test_a_second_run_computes_only_what_is_missing(suite, tmp_path):
    events = []
    first = simgap.run(suite("Mean"), out=tmp_path / "out")
    second = simgap.run(suite("Mean", "Scaled"), seeds=2, out=tmp_path / "out", progress=events.append)
    assert [row for row in second if row.model == "Mean" and row.seed == 0] == first
    assert "1 of 4 jobs are done already and were not run again" in [event.message for event in events]
    assert max(event.total for event in events) == 3


def test_failed_jobs_are_run_again_and_diverged_ones_are_not(suite, tmp_path):
    simgap.run(suite("RaisesInFit", "IsNaN"), out=tmp_path / "out")
    events = []
    simgap.run(suite("RaisesInFit", "IsNaN"), out=tmp_path / "out", progress=events.append)
    assert {row.model for event in events for row in event.finished} == {"RaisesInFit"}


def test_changed_data_are_run_again(suite, tmp_path, dataset):
    simgap.run(suite("Mean"), out=tmp_path / "out")
    changed = Dataset("noise", dataset.training, (dataset.test[0][:80], dataset.test[1]), 4, dataset.channels)
    save(changed, tmp_path / "again")
    (tmp_path / "noise").rename(tmp_path / "old")
    (tmp_path / "again").rename(tmp_path / "noise")
    rows = by_model(simgap.run(suite("Mean"), out=tmp_path / "out"))
    assert rows["Mean", "first", "free_run"].metrics["phi"]["n_scored"] == 76
    assert len(rows) == 4


def test_results_of_older_code_of_a_registered_model_are_run_again(tmp_path, folder):
    chosen = {"models": ["mean", "hold"], "datasets": [str(folder)], "out": tmp_path / "out"}
    simgap.run("smoke", **chosen)
    path = tmp_path / "out" / "smoke" / "mean.jsonl"
    digest = store.read(path)[0].provenance["model_sha256"]
    path.write_text(path.read_text().replace(digest, "0" * 64))
    events = []
    simgap.run("smoke", **chosen, progress=events.append)
    assert {row.model for event in events for row in event.finished} == {"mean"}


def test_a_changed_model_file_is_run_again(suite, tmp_path, folder):
    file = tmp_path / "mine.py"
    for value in (1.0, 2.0):
        file.write_text(
            "import numpy as np\nclass Mine:\n    def fit(self, data, seed): pass\n"
            f"    def simulate(self, u, y_init): return np.full((len(u), u.shape[1] - 4, 2), {value})\n"
        )
        rows = simgap.run("smoke", model=[f"{file}:Mine"], datasets=[str(folder)], out=tmp_path / "out")
        mae = rows[0].metrics["phi"]["mae"]
    assert mae > 1.5


def test_what_the_user_names_replaces_what_the_suite_lists(suite, tmp_path, example, folder):
    rows = simgap.run(suite("Mean"), model=example("Scaled"), datasets=[str(folder)], out=tmp_path / "out")
    assert {row.model for row in rows} == {"Scaled"}
    rows = simgap.run(suite("Mean", "Scaled"), models=["Mean"], out=tmp_path / "out")
    assert {row.model for row in rows} == {"Mean"}


def test_a_csv_file_is_run_with_its_columns_named(tmp_path, example):
    lines = ["t,u,y"] + [f"{i / 10},{(i * 7) % 5},{(i * 3) % 4}" for i in range(200)]
    (tmp_path / "mine.csv").write_text("\n".join(lines) + "\n")
    rows = simgap.run(
        model=[example("Mean")], datasets=[str(tmp_path / "mine.csv")], inputs=["u"], outputs=["y"],
        out=tmp_path / "out",
    )  # fmt: skip
    assert {(row.dataset, row.status) for row in rows} == {("mine", "ok")}


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"engine": "slurm"}, "there is no engine called 'slurm'; known are local, ray"),
        ({"engine": "ray"}, "say where the cluster is: --address HOST:PORT"),
        ({"address": "here"}, "--address is for --engine ray"),
        ({"jobs": 0}, "at least one worker"),
        ({"seeds": 0}, "at least one seed"),
        ({"suite": "nosuch"}, "no suite 'nosuch'"),
        ({"models": ["nosuch"]}, "no model called 'nosuch'"),
        ({"model": ["nosuch.py:Mine"]}, "no file nosuch.py"),
        ({"datasets": ["nosuch"]}, "nosuch"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_runs(arguments, complaint, suite, tmp_path):
    with pytest.raises(UnusableInput) as refusal:
        simgap.run(**{"suite": suite("Mean"), "out": tmp_path / "out"} | arguments)
    assert complaint in str(refusal.value)
    assert not (tmp_path / "out").exists()


def test_a_class_without_the_two_methods_is_refused(suite, tmp_path, example):
    with pytest.raises(UnusableInput, match="it has no method fit"):
        simgap.run(suite("Mean"), model=[example("NotAModel")], out=tmp_path / "out")


def test_two_models_of_one_name_are_refused(suite, tmp_path):
    with pytest.raises(UnusableInput, match="two models are called Mean"):
        simgap.run(suite("Mean", "Mean"), out=tmp_path / "out")


def test_missing_data_of_a_suite_are_noted_and_missing_data_of_the_user_refused(suite, tmp_path, monkeypatch):
    monkeypatch.setattr("simgap.data.measured.locations.roots", list)
    events = []
    path = suite("Mean", datasets='["cascaded_tanks", "noise"]')
    rows = simgap.run(path, out=tmp_path / "out", progress=events.append)
    assert {row.dataset for row in rows} == {"noise"}
    assert any(event.message.startswith("left out: cascaded_tanks is not at hand") for event in events)
    with pytest.raises(UnusableInput, match="cascaded_tanks is not at hand"):
        simgap.run(path, datasets=["cascaded_tanks"], out=tmp_path / "out")
    with pytest.raises(UnusableInput, match="none of the data sets"):
        simgap.run(suite("Mean", datasets='["cascaded_tanks"]'), out=tmp_path / "out", progress=events.append)


def test_a_script_without_a_main_guard_runs_once(suite, tmp_path):
    script = tmp_path / "script.py"
    out = str(tmp_path / "out")
    script.write_text(f"import numpy, simgap\nprint('here')\nprint(len(simgap.run({suite('Mean')!r}, out={out!r})))\n")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == ["here", "4"]
    assert done.stderr == ""


# A shell that runs the tests in the background has told its children to ignore Ctrl-C.
HEARS_CTRL_C = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
COMMAND = [sys.executable, "-c", HEARS_CTRL_C + "from simgap.cli import main; sys.exit(main())", "run"]


def wait_for(path, there=lambda path: path.exists() and path.stat().st_size):
    deadline = time.monotonic() + 60
    while not there(path):
        assert time.monotonic() < deadline, f"{path} did not appear"
        time.sleep(0.05)


def test_an_interrupted_run_keeps_what_is_done_and_carries_on(suite, tmp_path):
    out = tmp_path / "out"
    command = [*COMMAND, suite("Mean", "Hangs"), "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        wait_for(out / "mine" / "Mean.jsonl")
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=30)
    assert process.returncode == 130
    assert complaint == "interrupted; what is done is stored, and the same command carries on\n"
    events = []
    simgap.run(suite("Mean", "Hangs", timeout=1), out=out, progress=events.append)
    assert "1 of 2 jobs are done already and were not run again" in [event.message for event in events]


def test_the_workers_of_a_killed_run_end_too(suite, tmp_path):
    command = [*COMMAND, suite("Beats"), "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL) as process:
        wait_for(tmp_path / "beats.txt")
        process.kill()
    time.sleep(1)
    beats = (tmp_path / "beats.txt").stat().st_size
    time.sleep(0.5)
    assert (tmp_path / "beats.txt").stat().st_size == beats


def test_a_killed_training_carries_on_from_its_last_epoch(suite, tmp_path):
    out = tmp_path / "out"
    head = Path(suite()).read_text()
    slow = tmp_path / "slow.toml"
    slow.write_text(head + '[[models]]\nname = "gru"\nparams = { units = 4, epochs = 400, batches = 20 }\n')
    with subprocess.Popen([*COMMAND, str(slow), "--out", str(out)], stdout=subprocess.DEVNULL) as process:
        wait_for(out / ".checkpoints", lambda folder: any(folder.glob("*/*.safetensors")))
        process.kill()
    (checkpoint,) = (out / ".checkpoints").glob("*/*.safetensors")
    with safe_open(checkpoint, "np") as file:
        known = json.loads(file.metadata()["history"])["train"]
    assert 0 < len(known) < 400
    shares = []
    row = simgap.run(str(slow), out=out, progress=lambda progress: shares.append(progress.share))[0]
    assert row.fitted["train_loss"][: len(known)] == known
    assert any(0 < share < 1 for share in shares)  # of the one job, while it was under way
    assert not list((out / ".checkpoints").iterdir())


def test_data_reach_a_worker_as_they_are_and_read_only(dataset):
    again = pickle.loads(pickle.dumps(dataset))
    assert again.sha256 == dataset.sha256 == again._digest()
    for experiment in (*again.training.train, *again.training.valid, *again.test):
        assert not (experiment.u.flags.writeable or experiment.y.flags.writeable)


def test_two_data_sets_of_the_same_samples_are_each_scored_as_what_they_are(tmp_path, dataset, example):
    for name, unit in (("one", "deg"), ("other", "rad")):
        outputs = (replace(dataset.channels.outputs[0], unit=unit), dataset.channels.outputs[1])
        data = replace(dataset, name=name).with_channels(replace(dataset.channels, outputs=outputs))
        save(data, tmp_path / name)
    rows = simgap.run(
        model=[example("Mean")], datasets=[str(tmp_path / "one"), str(tmp_path / "other")], out=tmp_path / "out"
    )
    assert len({row.provenance["data_sha256"] for row in rows}) == 1
    assert {(row.dataset, row.units["phi"]) for row in rows} == {("one", "deg"), ("other", "rad")}


def test_columns_are_named_for_the_files_of_a_suite_too(tmp_path, example):
    lines = ["t,u,y"] + [f"{i / 10},{(i * 7) % 5},{(i * 3) % 4}" for i in range(200)]
    (tmp_path / "mine.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "mine.toml").write_text(f'datasets = ["mine.csv"]\n[[models]]\nname = "{example("Mean")}"\n')
    rows = simgap.run(str(tmp_path / "mine.toml"), inputs=["u"], outputs=["y"], out=tmp_path / "out")
    assert {(row.dataset, row.status) for row in rows} == {("mine", "ok")}
