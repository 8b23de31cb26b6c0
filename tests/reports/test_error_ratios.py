"""Rows that chance cannot tell from the best are marked as often as promised, and only where the runs are at hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import simgap
from simgap.data import load, save
from simgap.metrics import score_outputs
from simgap.records import Channel, Channels, Dataset, Experiment, Result, TrainingSet
from simgap.reports.error_ratios import HOW_TO_READ, error_ratio
from simgap.results import artefacts, store
from simgap.results.artefacts import Artefact

CHANNELS = Channels((Channel("u", "V"),), (Channel("phi", "deg"), Channel("omega", "deg/s")))
N_INIT = 4
DRAWS = 400


def slow_noise(rng, samples, memory=10):
    """Errors [N] of variance 1 whose autocorrelation is exp(-lag / memory)."""
    pole = np.exp(-1 / memory)
    w = rng.standard_normal(samples + 10 * memory)
    return lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], w)[10 * memory :]


def compared(rng, size, experiments, samples, shared=0.0):
    """Compare two models on one output, the one with `size` times the other's error; both err by `shared` too."""
    lengths = np.full(experiments, samples)
    one, other, both = (np.concatenate([slow_noise(rng, samples) for _ in lengths]).reshape(1, -1, 1) for _ in range(3))
    errors, of_best = size * one + shared * both, other + shared * both
    if np.sum(errors**2) < np.sum(of_best**2):
        errors, of_best = of_best, errors
    return error_ratio(errors, of_best, lengths)


@pytest.mark.parametrize(("experiments", "samples"), [(1, 2000), (4, 500)])
def test_models_that_err_alike_are_told_apart_in_five_of_a_hundred_records(experiments, samples):
    rng = np.random.default_rng(0)
    decided = [not compared(rng, 1.0, experiments, samples).undecided for _ in range(DRAWS)]
    assert 0.02 < np.mean(decided) < 0.08  # chance: 0.05 +- 0.022 of 400 draws


def test_a_difference_of_30_percent_is_found_in_long_records_and_the_interval_holds_it():
    rng = np.random.default_rng(1)
    found = [compared(rng, 1.3, 1, 10_000) for _ in range(100)]
    assert np.mean([one.low > 1 for one in found]) > 0.95
    assert np.mean([one.low <= 1.3 <= one.high for one in found]) > 0.88


def test_what_both_models_get_wrong_alike_hides_no_difference():
    rng = np.random.default_rng(2)
    found = [compared(rng, 1.3, 1, 4000, shared=3.0) for _ in range(40)]
    alone = [compared(rng, np.sqrt(1.69 + 9) / np.sqrt(10), 1, 4000) for _ in range(40)]
    assert np.mean([one.low > 1 for one in found]) > 2 * np.mean([one.low > 1 for one in alone])


def test_a_small_slow_error_of_the_best_hides_no_large_one_that_is_fast():
    rng = np.random.default_rng(6)
    decided = []
    for _ in range(100):
        errors, of_best = 6 * slow_noise(rng, 580, 30), slow_noise(rng, 580, 200)
        ratio = error_ratio(errors.reshape(1, -1, 1), of_best.reshape(1, -1, 1), np.array([580]))
        decided.append(ratio.low > 1)
    assert np.mean(decided) > 0.88  # 0.8 of the log of the ratio alone, whose blocks are as long as the slow error asks


def test_a_record_that_is_shorter_than_few_memories_tells_nothing():
    rng = np.random.default_rng(7)
    found = [compared(rng, 1.3, 1, 25) for _ in range(40)]
    assert np.mean([one.too_short for one in found]) > 0.3
    assert not any(one.too_short and one.undecided for one in found)
    assert all(("record too short" in str(one)) == one.too_short for one in found)
    assert not any(compared(rng, 1.0, 1, 4000).too_short for _ in range(40))


def test_a_perfect_model_and_one_that_grew_have_a_ratio():
    rng = np.random.default_rng(3)
    errors = rng.standard_normal((1, 200, 1))
    assert error_ratio(errors, np.zeros((1, 200, 1)), np.array([200])).low > 1e5
    assert error_ratio(1e30 * errors, 1e-9 * errors, np.array([200])).ratio > 1e30


@pytest.fixture
def measured(tmp_path):
    """Noise of two outputs in two test experiments, on disk and back."""
    rng = np.random.default_rng(4)
    parts = [
        Experiment(name, rng.standard_normal((n, 1)), rng.standard_normal((n, 2)) * (1, 50), 0.1)
        for name, n in (("a", 60), ("b", 60), ("first", 900), ("second", 300))
    ]
    training = TrainingSet((parts[0],), (parts[1],), N_INIT, CHANNELS)
    save(Dataset("cart", training, tuple(parts[2:]), N_INIT, CHANNELS), tmp_path / "cart")
    return load(tmp_path / "cart")


@pytest.fixture
def keep(measured, tmp_path):
    """`keep("arx", 0.3)` stores rows and free runs of a model with that error in units of the outputs' spread."""

    def write(model, size, seed=0, **more):
        rng = np.random.default_rng([seed, *model.encode()])
        runs, rows = {}, []
        about = {"model_sha256": model, "data_sha256": measured.sha256}
        for x in measured.test:
            y = x.y[N_INIT:]
            runs[x.name] = y + size * rng.standard_normal(y.shape) * (1, 50)
            figures = score_outputs(y, runs[x.name], CHANNELS)
            rows.append(Result(model, {}, "cart", x.name, "free_run", seed, more.get("status", "ok"), metrics=figures,
                               units={"phi": "deg", "omega": "deg/s"}, provenance=about))  # fmt: skip
        store.append(tmp_path / "out", "full", rows)
        source = {"source": str(tmp_path / "cart"), "inputs": [], "outputs": [], "dt": None}
        artefact = Artefact(runs, N_INIT, 0.1, source=source, **about)
        artefacts.write(artefacts.path_of(tmp_path / "out", "full", rows[0]), artefact)
        return artefacts.path_of(tmp_path / "out", "full", rows[0])

    return write


def of_cart(folder):
    """The table of the data set as cells by model and column, and its notes; the overview's cells by model."""
    overview, *_, table = simgap.report(folder).tables["full"]
    cells = {row[0].text: dict(zip(table.columns, row, strict=True)) for row in table.rows}
    return cells, table.notes, {row[0].text: row[1] for row in overview.rows}


def test_a_row_has_the_ratio_of_its_figures_and_one_that_may_be_as_good_is_marked(keep, tmp_path):
    for model, size in (("best", 0.3), ("twin", 0.302), ("behind", 0.5)):
        keep(model, size)
    cells, notes, overview = of_cart(tmp_path / "out")
    assert cells["best"]["error / best"].text == ""
    for model, marked in (("best", False), ("twin", True), ("behind", False)):
        assert cells[model]["fit %"].second == overview[model].second == marked
    ratio = (100 - cells["behind"]["fit %"].value) / (100 - cells["best"]["fit %"].value)
    assert cells["behind"]["error / best"].value == pytest.approx(ratio, rel=1e-6)
    assert HOW_TO_READ in notes
    page = (simgap.write_site(tmp_path / "out").parent / "datasets" / "cart.html").read_text()
    assert cells["behind"]["error / best"].text.partition(" (")[0] in page
    assert "error / best" in page


def test_without_free_runs_or_data_there_is_no_column_and_no_mark(keep, tmp_path):
    paths = [keep(model, size) for model, size in (("best", 0.3), ("twin", 0.302), ("behind", 0.5))]
    paths[1].unlink()
    cells, _, overview = of_cart(tmp_path / "out")
    assert cells["twin"]["error / best"].text == ""
    assert not overview["twin"].second
    assert cells["behind"]["error / best"].text
    artefacts.write(paths[0], replace(artefacts.read(paths[0]), data_sha256="of another copy"))
    cells, notes, _ = of_cart(tmp_path / "out")
    assert "error / best" not in cells["behind"]
    assert HOW_TO_READ not in notes


def test_several_seeds_are_averaged_and_one_without_a_run_leaves_the_row_out(keep, tmp_path):
    keep("best", 0.3)
    last = [keep("net", size, seed) for seed, size in enumerate((0.4, 0.5, 0.6))][-1]
    cells, *_ = of_cart(tmp_path / "out")
    expected = np.sqrt(np.mean([0.4**2, 0.5**2, 0.6**2])) / 0.3
    assert cells["net"]["error / best"].value == pytest.approx(expected, rel=0.05)
    last.unlink()
    assert "error / best" not in of_cart(tmp_path / "out")[0]["net"]


def test_a_run_that_left_all_bounds_is_not_compared(keep, tmp_path):
    keep("best", 0.3)
    path = keep("grown", 0.5)
    artefact = artefacts.read(path)
    artefacts.write(path, replace(artefact, runs=artefact.runs | {"second": np.full((296, 2), np.inf)}))
    assert "error / best" not in of_cart(tmp_path / "out")[0]["grown"]
