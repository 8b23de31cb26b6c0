"""What is said of measured machines when their records are changed: other halves of them, or fewer samples.

A right name should not depend on which part of a log is at hand; where less is told, no name is an honest answer.

python tests/diagnosis/changed_records.py [NAME ..]
"""

from __future__ import annotations

import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from golden import folder_of  # beside this file, which is a script

from simgap.data import load
from simgap.data.splits import hold_out_tails
from simgap.diagnosis.diagnose import diagnose
from simgap.records import Dataset, Experiment

STICKS = "valve_stiction backlash hysteresis dead_zone"
# The first names that are right, as those who measured the machine know.
RIGHT = {
    "dart_car": "coulomb_friction stribeck_friction dead_zone",
    "arm_pendulum": "gravity position_torque",
    "servo_xl330": "coulomb_friction stribeck_friction load_friction",
    "damper_20lb": "backlash hysteresis",
    "damper_36lb": "backlash hysteresis",
    "buck_converter": "curved_input curved_sensor",
    "loop_FIC20102": STICKS,
    "servo_xl330_goal": "input_saturation rate_limit",
    "loop_FIC46005": f"{STICKS} nothing",
    "loop_LIC30501": f"{STICKS} nothing",
    "loop_FIC40102C": "nothing",
    "loop_LIC44001": "nothing",
    "loop_PDIC10321": "nothing",
    "loop_LIC30102": "nothing",
    "two_heaters": "nothing",
}


def changed(dataset: Dataset) -> Iterator[tuple[str, Dataset]]:
    """The data set itself, and what a user with other parts of the same log would have."""
    train, valid, test = dataset.training.train, dataset.training.valid, dataset.test
    long = [record for record in train if len(record) > 4 * dataset.n_init]

    def of(train: Sequence[Experiment], valid: Sequence[Experiment], test: Sequence[Experiment]) -> Dataset:
        training = replace(dataset.training, train=tuple(train), valid=tuple(valid))
        return replace(dataset, training=training, test=tuple(test))

    yield "as it is", dataset
    yield "test and training swapped", of(*hold_out_tails(test), train + valid)
    yield "every second sample", of(*([every_second(record) for record in part] for part in (train, valid, test)))
    if long:
        yield "first half", of([record[: len(record) // 2] for record in long], valid, test)
        yield "second half", of([record[len(record) // 2 :] for record in long], valid, test)


def every_second(record: Experiment) -> Experiment:
    """The record at half the rate."""
    return Experiment(record.name, record.u[::2], record.y[::2], 2 * record.dt)


def main() -> None:
    """Print the names that are given, and count those that are right."""
    warnings.simplefilter("ignore")
    counts: Counter[str] = Counter()
    for name in sys.argv[1:] or RIGHT:
        for change, dataset in changed(load(str(folder_of(name)))):
            begun = time.perf_counter()
            answer = diagnose(dataset, views_too=False)
            named = [cause.effect for cause in answer.causes]
            suspected = [cause.effect for cause in answer.findings.suspects]
            right = (named or ["nothing"])[0] in RIGHT[name].split()
            verdict = "right" if right else "wrong" if named else "not named"
            counts[verdict] += 1
            seconds = time.perf_counter() - begun
            print(f"{name}, {change}: {verdict}, {named}, suspected {suspected}, {seconds:.1f} s", flush=True)
    print(dict(counts))


if __name__ == "__main__":
    main()
