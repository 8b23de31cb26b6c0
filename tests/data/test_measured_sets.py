"""The contract of every registered data set, and the facts of the measured ones."""

import inspect
import sys

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from simgap.data import Missing, available, card, describe, load
from simgap.records import Dataset, UnusableInput
from simgap.registry import DATASETS

PACKAGE = ("cascaded_tanks", "ced", "emps", "f16", "silverbox", "wiener_hammerstein")
DAISY = ("daisy_ballbeam", "daisy_exchanger", "daisy_hairdryer", "daisy_robot_arm")


@pytest.fixture(params=DATASETS.names())
def at_hand(request) -> tuple[str, Dataset]:
    """Each registered data set whose files are here."""
    try:
        return request.param, load(request.param)
    except Missing as missing:
        pytest.skip(str(missing))


def test_the_promised_sets_are_registered():
    assert {*PACKAGE, *DAISY} <= set(DATASETS.names())


def test_a_data_set_meets_the_contract(at_hand):
    name, data = at_hand
    assert data.name == name
    assert data.training.valid
    assert data.n_init >= 1
    for experiment in data.training.train + data.training.valid + data.test:
        assert len(experiment) > data.n_init
        assert type(experiment.dt) is float
    facts = describe(data)
    assert all(channel["std"] > 0 for channel in facts["inputs"] + facts["outputs"])
    names = [name for split in facts["splits"].values() for name in split["names"]]
    assert len(set(names)) == len(names)


def test_a_data_set_is_the_same_each_time_it_is_loaded(at_hand):
    name, data = at_hand
    assert load(name).sha256 == data.sha256


@pytest.mark.parametrize("name", DATASETS.names())
def test_a_data_set_has_a_card_and_needs_no_argument(name):
    title, *rest = card(name).splitlines()
    assert 10 < len(title) <= 110
    assert any(rest)
    parameters = inspect.signature(DATASETS[name]).parameters.values()
    assert not [p for p in parameters if p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD]


@pytest.mark.parametrize("name", PACKAGE + DAISY)
def test_a_card_tells_machine_channels_samples_source_and_licence(name):
    for heading in ("Machine:", "Channels:", "Samples:", "Source:", "Licence:"):
        assert heading in card(name)
    assert DATASETS[name].__name__ == name


@pytest.fixture(scope="module")
def raw(measured):
    """Variables of a .mat file of the package's folder, flattened."""

    def read(path: str) -> dict[str, np.ndarray]:
        content = loadmat(measured / "nonlinear_benchmarks" / path)
        return {key: value.ravel() for key, value in content.items() if not key.startswith("__")}

    return read


def flat(experiments) -> np.ndarray:
    return np.concatenate([experiment.y[:, 0] for experiment in experiments])


def test_the_tanks_keep_their_samples_units_and_window(raw):
    data, file = load("cascaded_tanks"), raw("Cascaded_Tanks/CascadedTanksFiles/dataBenchmark.mat")
    assert data.training.dt == 4.0
    assert data.n_init == 50
    assert np.array_equal(flat(data.training.train + data.training.valid), file["yEst"])
    assert np.array_equal(flat(data.test), file["yVal"])
    assert data.channels.outputs[0].kind == "level"
    assert [len(data.training.train[0]), len(data.training.valid[0])] == [768, 256]


def test_the_drives_have_two_records_each_way(raw):
    data, file = load("ced"), raw("CED/DATAUNIF.MAT")
    assert [e.name for e in data.test] == ["low_amplitude", "high_amplitude"]
    assert data.n_init == 10
    for k, key in enumerate(("z11", "z12")):
        parts = (data.training.train[k], data.training.valid[k], data.test[k])
        assert [len(part) for part in parts] == [300, 100, 100]
        assert np.array_equal(flat(parts), file[key])


def test_the_silverbox_tests_are_told_apart_by_position(raw):
    data, file = load("silverbox"), raw("Silverbox/SilverboxFiles/SNLS80mV.mat")
    tests = {e.name: e.y[:, 0] for e in data.test}
    assert list(tests) == ["multisine", "arrow_full", "arrow_no_extrapolation"]
    assert np.array_equal(tests["arrow_full"], file["V2"][100:40575])
    assert np.array_equal(tests["arrow_no_extrapolation"], file["V2"][100:32100])
    assert np.array_equal(flat([*data.training.train, *data.training.valid, data.test[0]]), file["V2"][40650:127400])
    assert data.training.dt == pytest.approx(1 / 610.35, rel=1e-12)


def test_wiener_hammerstein_is_tested_on_the_official_rows(raw):
    data, file = load("wiener_hammerstein"), raw("WienerHammerBenchMark/WienerHammerBenchMark.mat")
    assert np.array_equal(flat(data.test), file["yBenchMark"][105200:184000])
    assert np.array_equal(flat(data.training.train + data.training.valid), file["yBenchMark"][5200:105200])
    assert data.training.dt == 1 / 51200


@pytest.mark.parametrize(
    ("name", "dt", "samples"),
    [
        ("daisy_ballbeam", 0.1, 1000),
        ("daisy_exchanger", 1.0, 4000),
        ("daisy_hairdryer", 0.08, 1000),
        ("daisy_robot_arm", 1.0, 1024),
    ],
)
def test_a_daisy_record_is_split_in_time_and_complete(measured, name, dt, samples):
    data = load(name)
    assert data.training.dt == dt
    assert sum(len(e) for e in data.training.train + data.training.valid + data.test) == samples
    assert [e.name for e in data.training.train + data.training.valid + data.test] == [
        "train",
        "valid",
        "test",
    ]


def test_the_exchanger_leaves_out_the_sample_number(measured):
    data = load("daisy_exchanger")
    assert [len(data.channels.inputs), len(data.channels.outputs)] == [1, 1]
    assert data.training.train[0].u.max() < 2


@pytest.fixture
def made(no_files):
    """Files laid out as the package expects those of EMPS and F-16, which are not here."""
    folder = no_files / "nonlinear_benchmarks"
    rng = np.random.default_rng(0)
    (folder / "EMPS").mkdir(parents=True)
    (folder / "EMPS" / "EMPS.zip").touch()
    for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"):
        columns = {key: rng.normal(size=(200, 1)) for key in ("qm", "qg", "vir")}
        savemat(folder / "EMPS" / name, columns | {"t": np.arange(200.0)[:, None] * 0.001})
    inside = folder / "F16" / "F16GVT_Files" / "BenchmarkData"
    inside.mkdir(parents=True)
    (folder / "F16" / "F16GVT_Files.zip").touch()
    for stem in (
        "FullMSine_Level1",
        "SineSw_Level1",
        "FullMSine_Level2_Validation",
        "SineSw_Level2_Validation",
    ):
        record = {"Force": rng.normal(size=(1, 300)), "Voltage": rng.normal(size=(1, 300)), "Fs": 400.0}
        savemat(inside / f"F16Data_{stem}.mat", record | {"Acceleration": rng.normal(size=(3, 300))})
    savemat(inside / "F16Data_SpecialOddMSine_Level1.mat", record | {"Acceleration": rng.normal(size=(3, 300))})
    return folder


def test_emps_is_read_from_its_files_in_volts_and_metres(made):
    data = load("emps")
    assert data.n_init == 20
    assert data.training.dt == pytest.approx(0.001)
    assert [(e.name, len(e)) for e in data.training.train + data.training.valid + data.test] == [
        ("train", 150),
        ("train_tail", 50),
        ("pulses", 200),
    ]
    assert np.array_equal(flat(data.test), loadmat(made / "EMPS" / "DATA_EMPS_PULSES.mat")["qm"].ravel())
    assert [channel.unit for channel in data.channels.inputs + data.channels.outputs] == ["V", "m"]


def sample_pulses_every(made, dt: float) -> None:
    """Write the test file of EMPS anew with another clock."""
    file = made / "EMPS" / "DATA_EMPS_PULSES.mat"
    columns = {key: loadmat(file)[key] for key in ("qm", "qg", "vir")}
    savemat(file, columns | {"t": np.arange(200.0)[:, None] * dt})


def test_the_official_clocks_of_emps_differ_by_jitter_and_are_accepted(made):
    sample_pulses_every(made, 0.001 * (1 + 1.6e-5))
    data = load("emps")
    assert data.training.dt == 0.001
    assert data.test[0].dt == pytest.approx(0.001 * (1 + 1.6e-5), rel=1e-12)


def test_records_of_another_sampling_time_are_refused(made):
    sample_pulses_every(made, 0.001 * (1 + 1e-3))
    with pytest.raises(
        UnusableInput, match=r"pulses: sampled every 0\.001001.* s, the first experiment every 0\.001 s"
    ):
        load("emps")


def test_f16_is_read_from_its_files_without_the_odd_multisines(made):
    data = load("f16")
    assert [e.name for e in data.training.train] == ["F16Data_FullMSine_Level1", "F16Data_SineSw_Level1"]
    assert [e.name for e in data.test] == [
        "F16Data_FullMSine_Level2_Validation",
        "F16Data_SineSw_Level2_Validation",
    ]
    assert data.training.dt == 1 / 400
    assert data.n_init == 50


def test_a_broken_file_of_a_measured_set_is_refused_in_one_line(made):
    (made / "EMPS" / "DATA_EMPS.mat").write_bytes(b"<html>not\nfound</html>" * 50)
    with pytest.raises(UnusableInput, match=r"emps: the files in .* cannot be read") as caught:
        load("emps")
    assert not isinstance(caught.value, Missing)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.usefixtures("made")
def test_a_package_that_is_missing_is_no_broken_file(monkeypatch):
    monkeypatch.setitem(sys.modules, "nonlinear_benchmarks", None)
    with pytest.raises(
        UnusableInput, match=r"^emps cannot be read: a package is missing \(.*nonlinear_benchmarks.*\); install"
    ):
        load("emps")


@pytest.mark.parametrize("name", PACKAGE + DAISY)
def test_a_missing_set_names_the_command_and_creates_nothing(no_files, monkeypatch, name):
    def forbidden(*arguments, **named):
        raise AssertionError("a download was started")

    monkeypatch.setattr("urllib.request.urlopen", forbidden)
    monkeypatch.setattr("urllib.request.urlretrieve", forbidden)
    monkeypatch.setattr("requests.Session.get", forbidden)
    with pytest.raises(Missing, match=f"simgap data fetch {name}"):
        load(name)
    assert not no_files.exists()
    assert available()[name] == f"{name} is not at hand; get it with `simgap data fetch {name}`"


def test_a_set_with_only_some_of_its_files_is_missing(made):
    (made / "EMPS" / "EMPS.zip").unlink()  # the package would download again
    with pytest.raises(Missing):
        load("emps")


def test_files_are_found_in_the_folder_of_the_collection_itself_too(made, monkeypatch):
    monkeypatch.setattr("simgap.data.measured.locations.roots", lambda: [made])
    assert load("emps").name == "emps"


def test_the_folder_of_the_environment_is_searched_first_and_the_cache_last(tmp_path, monkeypatch):
    from simgap.data.measured.locations import cache, roots

    (tmp_path / "shared" / "data").mkdir(parents=True)
    (tmp_path / "checkout").mkdir()
    monkeypatch.chdir(tmp_path / "checkout")
    monkeypatch.setenv("SIMGAP_DATA", str(tmp_path / "mine"))
    found = roots()
    assert found[:2] == [tmp_path / "mine", tmp_path / "shared" / "data"]
    assert found[-1] == cache()


def test_listing_what_is_available_reads_no_file(made, monkeypatch):
    monkeypatch.setattr("scipy.io.loadmat", None)
    assert available()["emps"] == ""
    assert available()["f16"] == ""
    assert "fetch ced" in available()["ced"]


def test_a_measured_set_may_start_from_fewer_samples_as_older_publications_did(measured):
    usual, early = load("ced"), load("ced-n_init4")
    assert early.name == "ced-n_init4"
    assert (usual.n_init, early.n_init, early.training.n_init) == (10, 4, 4)
    assert all(np.array_equal(a.y, b.y) for a, b in zip(usual.test, early.test, strict=True))


@pytest.mark.parametrize("name", ["ced", "cascaded_tanks"])
def test_another_start_is_another_data_set_to_all_who_tell_them_apart_by_their_digest(name):
    if available()[name]:
        pytest.skip(f"{name} is not at hand")
    assert load(name).sha256 != load(f"{name}-n_init4").sha256
