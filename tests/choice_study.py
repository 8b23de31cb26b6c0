"""How good a model a few runs give that were chosen one by one, beside runs drawn at random.

    python tests/choice_study.py FOLDER RUNS SEED ..

FOLDER is a data set with the columns of `sts3215`, or that name. Each seed draws one training run. Then the model is
identified from the runs at hand, the inputs of all others are ranked by `simgap.choose_record`, and the best is put
beside those at hand, with its outputs, until there are so many RUNS. As many runs drawn at once are identified too.
Each line: root mean square, that over readings that are no glitches, and mean absolute error of the free run over all
test runs in rad, and the effects.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgap import load
from simgap.cores import all_cores
from simgap.data.formats.plant_table import with_known
from simgap.data.measured.servo_sts3215 import PLANT
from simgap.experiment_design.choice import ranked
from simgap.greybox.identification import Identified, identify
from simgap.records import Dataset

GLITCH, NEAR = -3.14, 0.02  # rad: what the encoder reads where it reads nothing


def of_runs(data: Dataset, names: Sequence[str]) -> Dataset:
    """Keep these training runs, and no validation runs."""
    runs = {x.name: x for x in (*data.training.train, *data.training.valid)}
    return replace(data, training=replace(data.training, train=tuple(runs[name] for name in names), valid=()))


def scores(data: Dataset, found: Identified) -> str:
    """Simulate the test runs freely and tell the errors, and the effects."""
    errors, read = [], []
    for x in data.test:
        y = found.plant.simulate_whole(x.u[None], x.y[None, : data.n_init])[0, data.n_init :, 0]
        measured = x.y[data.n_init :, 0]
        errors.append(measured - y)
        read.append(np.abs(measured - GLITCH) > NEAR)
    e, read = np.concatenate(errors), np.concatenate(read)
    effects = ", ".join(term.effect.name for term in found.plant.estimate.plant.terms)
    return f"{np.sqrt(np.mean(e**2)):.4f} {np.sqrt(np.mean(e[read] ** 2)):.4f} {np.mean(np.abs(e)):.4f} {effects}"


def main() -> None:
    """Print the model of all runs, then of each seed the chosen runs one by one, and the drawn ones."""
    data, count = with_known(load(sys.argv[1]), PLANT), int(sys.argv[2])
    pool = {x.name: x.u for x in (*data.training.train, *data.training.valid)}
    begin = time.perf_counter()

    def tell(what: str, names: Sequence[str]) -> Identified:
        (found,) = identify(of_runs(data, names).training)
        print(what, scores(data, found), f"{time.perf_counter() - begin:.0f} s", flush=True)
        return found

    with all_cores():
        tell("all", list(pool))
        for seed in map(int, sys.argv[3:]):
            drawn = list(np.random.default_rng(seed).permutation(list(pool))[:count])
            tell(f"drawn, seed {seed}", drawn)
            chosen = drawn[:1]
            found = tell(f"chosen, seed {seed}, 1 {chosen[0]}", chosen)
            while len(chosen) < count:
                chosen.append(ranked(of_runs(data, chosen), [found], pool).best)
                found = tell(f"chosen, seed {seed}, {len(chosen)} {chosen[-1]}", chosen)


if __name__ == "__main__":
    main()
