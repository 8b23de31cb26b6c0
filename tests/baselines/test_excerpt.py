"""What a model looks at first, where there is more than it needs."""

import numpy as np

from simgap.baselines.estimation.batches import excerpt
from simgap.records import Experiment


def experiments(*lengths):
    """Experiments that count their samples."""
    return [Experiment(f"e{k}", np.arange(n)[:, None] * 1.0, np.zeros((n, 1)), 1.0) for k, n in enumerate(lengths)]


def test_an_excerpt_has_the_ends_of_experiments_from_the_first_to_the_last():
    taken = excerpt(experiments(*[5000] * 30), 8192)
    assert len(taken) == 8 and [taken[0].name, taken[-1].name] == ["e0", "e29"]
    assert {len(x) for x in taken} == {1024} and {x.u[-1, 0] for x in taken} == {4999.0}


def test_of_many_short_experiments_as_many_are_taken_as_make_up_the_samples():
    taken = excerpt(experiments(*[200] * 151), 8192)
    assert len(taken) == 40 and all(len(x) == 200 for x in taken)
    assert [taken[0].name, taken[-1].name] == ["e0", "e150"]


def test_experiments_that_are_few_enough_are_all_taken_whole():
    assert [len(x) for x in excerpt(experiments(300, 500), 800)] == [300, 500]


def test_of_one_long_experiment_its_end_is_taken():
    (taken,) = excerpt(experiments(10000), 8192)
    assert len(taken) == 8192 and taken.u[-1, 0] == 9999.0


def test_what_short_experiments_leave_goes_to_the_long_one_wherever_it_stands():
    for at in (0, 50, 99):
        lengths = [10] * 99
        lengths.insert(at, 100_000)
        taken = excerpt(experiments(*lengths), 8192)
        assert sum(map(len, taken)) == 8192 and max(map(len, taken)) > 8000
