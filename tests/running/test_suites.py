import pytest

from simgap.data.named import is_registered
from simgap.records import UnusableInput
from simgap.registry import DATASETS, MODELS
from simgap.running.suites import Entry, load_suite, suite_names


def written(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("name", suite_names())
def test_every_suite_names_known_models_and_data_sets(name):
    suite = load_suite(name)
    assert all(map(is_registered, suite.datasets))
    assert {entry.name for entry in suite.models} <= set(MODELS)


def test_full_is_everything():
    suite = load_suite("full")
    assert set(suite.datasets) == set(DATASETS) - {"gimbal_short", "gm6020"}
    assert [entry.name for entry in suite.models if not entry.label.endswith(" windowed")] == list(MODELS)


def test_smoke_is_every_model_but_on_little_data():
    suite = load_suite("smoke")
    assert {entry.name for entry in suite.models} == set(MODELS)
    assert suite.datasets == ("gimbal_short",)


def test_the_paper_has_twenty_networks_and_four_classical_models_and_three_that_it_only_speaks_of():
    entries = load_suite("paper").models
    delta = [entry for entry in entries if entry.label.endswith(" delta")]
    assert (len(entries), len(delta)) == (27, 12)
    assert all(entry.name == "delta" for entry in delta)


def test_the_benchmark_is_everything_that_is_quick_and_any_model_of_somebodys_own(monkeypatch):
    slow = set(MODELS) - {entry.name for entry in load_suite("benchmark").models}
    assert {"wiener-hammerstein", "greybox-auto"} < slow < set(MODELS)
    monkeypatch.setitem(MODELS._targets, "my_own", object())
    assert "my_own" in {entry.name for entry in load_suite("benchmark").models}


def test_models_that_are_left_out_must_be_known(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('without_models = ["nosuch"]')
    with pytest.raises(UnusableInput, match="without_models: there is no registered model 'nosuch'"):
        load_suite(str(path))


NETWORKS = (
    "conv1d", "decoder", "dynonet", "encoder", "gru", "inception", "inception_regularised", "lru", "lstm",
    "neural-ode", "srnn", "subnet", "tcn", "tcns", "transformer",
)  # fmt: skip


def test_the_groups_of_full_and_smoke_are_the_tables_that_stood_there():
    windowed = {"mode": "windowed", "epochs": 300, "learning_rate": 0.001}
    on_windows = [name for name in NETWORKS if name not in ("neural-ode", "subnet")]
    assert load_suite("full").models == (
        *(Entry(name) for name in MODELS),
        *(Entry(name, windowed, f"{name} windowed") for name in on_windows[:-1]),
        Entry("transformer", windowed | {"batches": 60}, "transformer windowed"),
    )
    assert load_suite("smoke").models == (
        *(Entry(name) for name in MODELS if name not in (*NETWORKS, "ensemble")),
        Entry("arx", {"na": 3, "nb": 2, "nk": 1}, "ARX321"),
        *(Entry(name, {"epochs": 3, "batches": 10}) for name in NETWORKS),
        Entry("ensemble", {"models": ["hybrid", "lstm", "encoder"], "epochs": 3, "batches": 10}),
    )


def test_a_group_stands_for_one_table_per_name(tmp_path):
    text = """
    [groups]
    mine = ["arx", "my_model.py:Mine"]
    [[models]]
    group = "mine"
    label = "{name} on GPU"
    gpus = 0.5
    """
    (tmp_path / "my_model.py").touch()
    entries = load_suite(written(tmp_path, text)).models
    assert [(entry.name, entry.label, entry.gpus) for entry in entries] == [
        ("arx", "arx on GPU", 0.5), (f"{tmp_path / 'my_model.py'}:Mine", "Mine on GPU", 0.5)
    ]  # fmt: skip


def test_a_user_writes_a_suite_with_labels_and_parameters(tmp_path):
    text = """
    datasets = ["gimbal"]
    tasks = ["free_run"]
    seeds = 3
    timeout = 1.5
    [[models]]
    name = "arx"
    label = "ARX321"
    params = { na = 3 }
    """
    suite = load_suite(written(tmp_path, text))
    assert suite.models == (Entry("arx", {"na": 3}, "ARX321"),)
    assert (suite.name, suite.tasks, suite.seeds, suite.timeout) == ("mine", ("free_run",), 3, 1.5)


def test_a_table_takes_the_place_of_a_model_that_all_has_brought(tmp_path):
    text = '[[models]]\nname = "all"\n[[models]]\nname = "gru"\nparams = { epochs = 1 }\ngpus = 0.5\n'
    entries = {entry.label: entry for entry in load_suite(written(tmp_path, text)).models}
    assert set(entries) == set(MODELS)
    assert (entries["gru"].params, entries["gru"].gpus) == ({"epochs": 1}, 0.5)


def test_all_models_and_one_more_fit_in_one_suite(tmp_path):
    text = '[[models]]\nname = "all"\n[[models]]\nname = "arx"\nlabel = "ARX321"\n'
    assert [entry.label for entry in load_suite(written(tmp_path, text)).models] == [*MODELS, "ARX321"]


def test_paths_in_a_suite_count_from_its_file(tmp_path):
    (tmp_path / "my_data").mkdir()
    (tmp_path / "my_model.py").touch()
    text = 'datasets = ["my_data"]\n[[models]]\nname = "my_model.py:Mine"\n[[models]]\nname = "my_model.py"\n'
    suite = load_suite(written(tmp_path, text))
    assert suite.datasets == (str(tmp_path / "my_data"),)
    assert [entry.name for entry in suite.models] == [f"{tmp_path / 'my_model.py'}:Mine", f"{tmp_path / 'my_model.py'}"]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("title = ", "Invalid value"),
        ("titel = 1", "unknown key 'titel'"),
        ("title = 1", "title is 1"),
        ("seeds = true", "seeds is True"),
        ("seeds = 0", "must be positive"),
        ("timeout = nan", "must be positive"),
        ("memory = inf", "memory finite"),
        ('without_models = ["arx"]\n[[models]]\nname = "oe"', 'without_models goes with the model "all" only'),
        ('tasks = ["predict"]', "no task 'predict'"),
        ("tasks = []", "tasks is empty"),
        ("tasks = [1]", "no task '1'"),
        ("datasets = [1]", "datasets must be"),
        ('datasets = "some"', "datasets must be"),
        ('without = ["tanks"]', "without: there is no registered data set 'tanks'"),
        ('datasets = ["gimbal"]\nwithout = ["gimbal"]', 'without goes with datasets = "all" only'),
        ('models = ["arx"]', "models must be"),
        ('[[models]]\nlabel = "x"', "needs a name"),
        ('[[models]]\nname = "arx"\nparams = 3', "needs a name"),
        ('[[models]]\nname = "arx"\nparam = {}', "unknown key 'param'"),
        ("groups = 1", "groups must be a table"),
        ('[groups]\na = "arx"\n[[models]]\ngroup = "a"', "the group a must be a list of names"),
        ('[groups]\na = []\n[[models]]\ngroup = "a"', "the group a must be a list of names"),
        ('[groups]\na = ["all"]\n[[models]]\ngroup = "a"', "the group a cannot hold all"),
        ('[[models]]\ngroup = "a"', "there is no group 'a'; known are none"),
        ('[groups]\na = ["arx"]\n[[models]]\ngroup = ["a"]', "there is no group ['a']; known are a"),
        ('[groups]\na = ["arx"]\n[[models]]\ngroup = "a"\nname = "arx"', "a name or a group, not both"),
        ('[groups]\na = ["arx"]\n[[models]]\ngroup = "a"\nlabel = "x"', "needs {name} in it"),
        ('[groups]\na = ["arx"]\n[[models]]\ngroup = "a"\nparam = {}', "unknown key 'param'"),
    ],
)
def test_a_wrong_suite_is_refused_in_one_sentence(tmp_path, text, complaint):
    with pytest.raises(UnusableInput, match=r"mine\.toml") as refusal:
        load_suite(written(tmp_path, text))
    assert complaint in str(refusal.value)


def test_an_unknown_suite_is_refused_with_the_known_ones():
    known = "benchmark, crossover, full, paper, records, smoke, tuned, recovery"
    with pytest.raises(UnusableInput, match=f"no suite 'nosuch'; known are {known}"):
        load_suite("nosuch")


def test_the_recovery_study_is_no_suite_and_says_how_it_is_run():
    with pytest.raises(UnusableInput, match="is a study and no suite of models; `simgap run recovery` runs it"):
        load_suite("recovery")
