"""The seeds of a model without randomness: the same data, other rounding."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import simgap
from simgap.records import Experiment, TrainingSet
from simgap.running.rounding import in_other_units

VALUES = arrays(np.float64, (20, 2), elements=st.floats(-1e6, 1e6).map(lambda x: round(x, 3)))


@given(u=VALUES, y=VALUES, seed=st.integers(1, 50))
def test_what_is_equal_or_in_order_or_nothing_stays_so_and_nobody_could_measure_the_change(u, y, seed):
    x = Experiment("one", u, y, 0.1)
    other = in_other_units(TrainingSet((x,), (x,), n_init=2), seed)
    for (moved,) in (other.train, other.valid):
        for before, after in ((u, moved.u), (y, moved.y)):
            np.testing.assert_allclose(after, before, rtol=1e-11)
            for one, same in zip(before.T, after.T, strict=True):
                order = np.argsort(one, kind="stable")
                steps = np.diff(one[order])
                assert (np.diff(same[order])[steps > 0] > 0).all()
                assert (np.diff(same[order])[steps == 0] == 0).all()


def test_seed_0_takes_the_data_as_they_are():
    x = Experiment("one", np.ones((5, 1)), np.ones((5, 1)), 0.1)
    data = TrainingSet((x,), (), n_init=2)
    assert in_other_units(data, 0) is data


def test_the_seeds_of_a_model_that_computes_differ_in_its_last_digits_and_each_is_repeated(tmp_path):
    def figures(out):
        rows = simgap.run("smoke", models=["arx"], seeds=3, out=out)
        return [row.metrics["phi"]["rmse"] for row in rows if row.task == "free_run" and row.experiment == first(rows)]

    def first(rows):
        return rows[0].experiment

    once, again = figures(tmp_path / "once"), figures(tmp_path / "again")
    assert once == again
    assert len(set(once)) == 3
    np.testing.assert_allclose(once, once[0], rtol=1e-9)
