"""The interval of the gain: it holds the gain, keeps its promise of chance, and does not fail on what tests bring."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from simgap.diagnosis.gains import measure
from simgap.error_views.correlation import correlation_time
from simgap.error_views.gain_interval import block_starts, share_of_few, share_with_interval
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet

STUDY = runpy.run_path(str(Path(__file__).with_name("interval_study.py")))
LOSSES = st.one_of(st.just(1e-18), st.floats(1e-12, 1e6), st.just(1e120))


def white(rng, samples, size=1.0):
    return (size * rng.standard_normal(samples)) ** 2


@settings(deadline=None, max_examples=200)
@given(st.data(), st.lists(st.integers(1, 12), min_size=1, max_size=5))
def test_the_interval_holds_the_gain_whatever_the_losses(data, lengths):
    before, after = (
        np.array(data.draw(st.lists(LOSSES, min_size=sum(lengths), max_size=sum(lengths)))) for _ in range(2)
    )
    share, low, high = share_with_interval(before, after, np.array(lengths))
    assert low <= share <= high <= 1.0
    assert share == pytest.approx(max(1 - np.sqrt(after.mean() / before.mean()), 1 - np.exp(100.0)), rel=1e-9, abs=1e-9)


def test_of_white_errors_the_interval_is_as_wide_as_theory_says():
    # The mean of N squares of variance 2 sigma^4 has the relative variance 2 / N; the log of the ratio of two, 4 / N.
    rng = np.random.default_rng(0)
    widths = []
    for _ in range(100):
        _, low, high = share_with_interval(white(rng, 4000), white(rng, 4000), np.full(4, 1000))
        widths.append(0.5 * np.log((1 - low) / (1 - high)) / 0.5)
    assert np.mean(widths) == pytest.approx(2.13 * np.sqrt(4 / 4000), rel=0.15)  # Student's t with 15 degrees


def test_a_record_without_a_reading_changes_no_correlation():
    error, lengths = np.convolve(np.random.default_rng(2).standard_normal(90), np.ones(5), "same"), [40, 50]
    assert correlation_time(error, [0, 40, 0, 50], 1) == correlation_time(error, lengths, 1)


def test_the_memory_of_errors_widens_the_interval():
    rng = np.random.default_rng(1)

    def width(memory):
        before, after = (STUDY["errors"](rng, 4, 1000, memory).ravel() ** 2 for _ in range(2))
        _, low, high = share_with_interval(before, after, np.full(4, 1000))
        return np.log((1 - low) / (1 - high))

    # Squares of errors with rho_k = exp(-k / 20) have exp(-k / 10): 20 of them count as one, with exp(-2 k) 1.3.
    widths = [np.mean([width(memory) for _ in range(40)]) for memory in (1, 20)]
    assert 3.0 < widths[1] / widths[0] < 7.0


@pytest.mark.parametrize(("slow", "shown"), [(0.0, True), (0.1, False)])
def test_a_large_gain_is_shown_whatever_the_sizes_of_errors_but_a_slow_error_is_seen_once(slow, shown):
    rng = np.random.default_rng(6)
    size = np.exp(np.linspace(-3, 0, 800))  # so that the memory of its square is as long as the record
    before = slow + size * STUDY["errors"](rng, 1, 800, 20)[0]
    after = 0.1 * slow + 0.002 * rng.standard_normal(800)
    memory = max(correlation_time(e, [800], 0)[0] for e in (before, after))
    assert (share_with_interval(before**2, after**2, np.array([800]), memory)[1] > 0.5) == shown


def test_a_record_of_a_few_memories_shows_a_large_gain():
    # Errors of one memory and more of another machine: Gaussian, slow, one of them twenty times as small.
    rng = np.random.default_rng(12)
    shown = []
    for _ in range(100):
        before, after = (STUDY["errors"](rng, 1, 200, 50)[0] for _ in range(2))
        memory = max(correlation_time(e, [200], 0)[0] for e in (before, after))
        shown.append(share_of_few(before**2, (0.05 * after) ** 2, np.array([200]), memory) > 0)
    assert np.mean(shown) > 0.6


@pytest.mark.parametrize("experiments", [1, 4])
@pytest.mark.parametrize("memory", [1, 10, 150])
@pytest.mark.parametrize("sizes", ["even", "half", "bursts"])
def test_no_size_of_errors_and_no_memory_makes_chance_pass_for_a_gain(sizes, memory, experiments):
    rng, above = np.random.default_rng(13), []
    for _ in range(300):
        size = np.full((2, experiments, 100), 0.1)
        for k, experiment in np.ndindex(2, experiments):
            at = {"even": 0, "half": 50, "bursts": rng.integers(95)}[sizes]
            size[k, experiment, at : at + 5 if sizes == "bursts" else None] = 1.0
        both = [(s * STUDY["errors"](rng, experiments, 100, memory)).ravel() for s in size]
        known = max(correlation_time(e, np.full(experiments, 100), 0)[0] for e in both)
        above.append(share_of_few(*(e**2 for e in both), np.full(experiments, 100), known) > 0)
    assert np.mean(above) < 0.045  # 2.5 % and what chance adds to it in 300 draws


def test_of_few_experiments_no_block_is_shorter_than_asked_but_where_two_are_wanted():
    lengths = np.array([200, 200, 200])
    assert block_starts(lengths, 150.0, least=1).tolist() == [0, 200, 400]
    assert block_starts(lengths, 150.0).tolist() == [0, 100, 200, 300, 400, 500]


def test_the_order_of_experiments_and_the_unit_of_the_output_do_not_matter():
    rng = np.random.default_rng(2)
    before, after = (STUDY["errors"](rng, 5, 200, 10) ** 2 for _ in range(2))  # [5, 200]
    intervals = [
        share_with_interval(unit * before[order].ravel(), unit * after[order].ravel(), np.full(5, 200))
        for order, unit in (([0, 1, 2, 3, 4], 1.0), ([3, 0, 4, 2, 1], 1e-6))
    ]
    assert intervals[0] == pytest.approx(intervals[1], rel=1e-9)


@pytest.mark.parametrize(("experiments", "samples"), [(1, 1), (1, 2), (1, 5), (2, 1), (2, 5), (15, 2)])
def test_a_few_samples_make_the_interval_wide_and_not_wrong(experiments, samples):
    rng = np.random.default_rng(3)
    losses = [[white(rng, experiments * samples) for _ in range(2)] for _ in range(300)]
    above = [share_with_interval(*pair, np.full(experiments, samples))[1] > 0 for pair in losses]
    assert np.mean(above) < 0.1  # 2.5 % is promised; two samples alone give 5 % in the long run


def test_errors_that_sit_in_two_of_ten_experiments_are_seen_twice():
    # With 9 degrees of freedom, as if all ten told something, 19 % of the intervals lie above zero.
    rng = np.random.default_rng(9)
    sizes = np.array([10.0, 10.0, *[1.0] * 8])[:, None]
    above = []
    for _ in range(300):
        before, after = ((sizes * STUDY["errors"](rng, 10, 60, 20)).ravel() ** 2 for _ in range(2))
        above.append(share_with_interval(before, after, np.full(10, 60))[1] > 0)
    assert np.mean(above) < 0.08


def test_a_gain_that_one_burst_of_many_samples_brings_is_not_believed():
    rng = np.random.default_rng(4)
    before, after = white(rng, 4000), white(rng, 4000)
    before[1000:1060] += 40.0  # as much as all the rest of one experiment and a half
    share, low, _ = share_with_interval(before, after, np.full(4, 1000))
    assert share > 0.15
    assert low < 0


def test_a_gain_in_every_part_of_the_record_is_believed():
    rng = np.random.default_rng(5)
    noise = white(rng, 600)
    assert share_with_interval(1.5 * noise, noise, np.array([600]))[1] > 0.1


def test_where_every_block_gains_much_the_interval_lies_above_zero_though_one_of_them_holds_what_is_left():
    noise = white(np.random.default_rng(8), 1200)
    left = np.full(1200, 0.002)
    left[1050:] = 0.15  # one block of eight, which gained least
    assert share_with_interval(noise, left * noise, np.full(4, 300))[1] > 0


def test_models_that_err_alike_gain_exactly_nothing():
    losses = white(np.random.default_rng(6), 300)
    assert share_with_interval(losses, losses, np.array([100, 200])) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("lengths", [(100,), (7, 100, 3), (1,), (1, 1)])
@pytest.mark.parametrize("shortest", [1.0, 2.5, 30.0, 1e9])
def test_blocks_keep_to_their_experiment_and_their_length(lengths, shortest):
    starts = block_starts(np.array(lengths), shortest)
    sizes = np.diff([*starts, sum(lengths)])
    assert set(np.cumsum((0, *lengths[:-1]))) <= set(starts)
    assert np.all(sizes > 0)
    assert len(block_starts(np.array([30] * 15), 1e9)) == 15
    assert len(starts) >= sum(min(length, 2) for length in lengths)  # of few experiments
    assert all(size >= int(shortest) or size >= min(lengths) // 2 for size in sizes)


def dataset(y):
    experiments = tuple(Experiment(f"e{i}", np.ones((len(part), 1)), part, 0.1) for i, part in enumerate(y))
    channels = Channels((Channel("u", "V"),), (Channel("y", "m"),))
    return Dataset("made", TrainingSet(experiments, (), 2, channels), experiments, 2, channels)


@pytest.mark.parametrize(("before", "after", "share"), [(np.inf, 0.5, 1.0), (0.5, np.inf, -np.inf)])
def test_a_simulation_that_grows_without_bound_is_compared_without_a_number(before, after, share):
    rng = np.random.default_rng(7)
    y = [rng.standard_normal((50, 1)) for _ in range(3)]
    simulated = [[part[2:] + size * rng.standard_normal((48, 1)) for part in y] for size in (0.5, 0.5)]
    for runs, size in zip(simulated, (before, after), strict=True):
        runs[1][20:] = y[1][22:] + size
    gain = measure(dataset(y), *simulated)
    assert gain.share == share
    assert gain.low <= gain.share <= gain.high
    assert np.isinf([gain.before["y"], gain.after["y"]]).tolist() == [before == np.inf, after != 0.5]


def test_the_gain_is_that_of_the_root_mean_square_errors():
    rng = np.random.default_rng(8)
    y = [rng.standard_normal((length, 1)) for length in (60, 20, 40)]
    before, after = ([part[2:] + size for part in y] for size in (0.4, 0.1))
    gain = measure(dataset(y), before, after)
    assert (gain.before["y"], gain.after["y"], gain.share) == pytest.approx((0.4, 0.1, 0.75), rel=1e-9)


@pytest.mark.parametrize(("size", "shown"), [(0.9, True), (1.1, False)])
def test_a_simulation_that_errs_more_than_the_mean_of_the_data_shows_nothing(size, shown):
    rng = np.random.default_rng(9)
    y = [rng.standard_normal((400, 1)) for _ in range(3)]
    spread = np.std(np.concatenate([part[2:] for part in y]))
    gain = measure(dataset(y), *([part[2:] + of * spread for part in y] for of in (5.0, size)))
    assert gain.low > 0
    assert (gain.beats_mean, gain.shown) == (shown, shown)


def test_an_offset_of_the_readings_makes_no_simulation_better():
    rng = np.random.default_rng(10)
    y = [300 + 0.1 * rng.standard_normal((400, 1)) for _ in range(3)]  # a temperature in kelvin
    gain = measure(dataset(y), *([part[2:] + of * rng.standard_normal((398, 1)) for part in y] for of in (0.5, 0.15)))
    assert gain.low > 0 and not gain.beats_mean


def test_numbers_that_were_fitted_to_a_test_experiment_gain_nothing_where_there_is_nothing():
    rng, n, gains = np.random.default_rng(11), 400, []
    shapes = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, n - 2), 4))[0]
    for _ in range(40):
        noise = [lfilter([1], [1, -0.9], rng.standard_normal(n))[:, None] for _ in range(4)]
        zero = [np.zeros((n - 2, 1)) for _ in noise]
        fitted = [shapes @ (shapes.T @ part[2:]) for part in noise]
        gains.append([measure(dataset(noise), zero, fitted, own) for own in ((), (5,))])
    unpaid, paid = (np.array([gain.low > 0 for gain in of]) for of in zip(*gains, strict=True))
    assert unpaid.mean() > 0.5 and paid.mean() < 0.1


@pytest.mark.slow
def test_nothing_is_named_as_seldom_as_promised_and_what_is_there_is_found():
    rows = list(STUDY["study"](400))
    nothing = np.array([shares[0] for *_, shares in rows])
    # 2.5 % is what the interval promises. Of 400 draws chance gives up to 2 % more; a single record of two or three
    # memories cannot tell its memory, hence the rest.
    assert nothing.max() < 0.08
    assert 0.01 < nothing.mean() < 0.045
    power = {(memory, samples, experiments): shares for memory, samples, experiments, shares in rows}
    assert power[1, 1000, 4][1] > 0.98
    assert power[1, 300, 1][2] > 0.95
    assert power[10, 300, 4][2] > 0.9
    assert power[50, 1000, 15][2] > 0.98
