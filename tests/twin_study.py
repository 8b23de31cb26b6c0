"""How often a designed record tells twins apart that the records at hand leave undecided, and how often a random one.

Two machines that move alike under the inputs at hand: a delay and a lag, a spring that softens and a pendulum, dry
friction and a dead zone, a weak motor and a heavy rotor on an arm of known mass. Half of the seeds have the one, half
the other. Where `simgap next` leaves the truth and its twin as rivals, the machine takes the designed record and, from
the same initial state, a random one of the same length and power that stays within the travel: steps, sines, a
triangle or a chirp, as rigs draw them. Either is put beside the records at hand, and the machine is diagnosed again.
The right answer names the truth, and the twin neither as a cause nor as one that the records do not tell from it. Of
motor and arm, the user's simulation has the usual numbers of both; the right answer shows the wrong one outside of its
interval and more than 5 % off, and not the other. Seeded.

python tests/twin_study.py COUNT [PAIR ..]          so many undecided cases of each pair, and the table
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

from twins import PAIRS, STREAMS, Machine, Twins, with_record

from simgap.diagnosis.diagnose import diagnose
from simgap.experiment_design.next_record import NextRecord, next_record
from simgap.records import Dataset, Experiment, UnusableInput

MATTERS = 0.05  # of a number


@dataclass(frozen=True)
class Case:
    """One undecided case: the chance that was expected of the designed record, and what was told after either."""

    seed: int
    truth: str
    chance: float
    designed: bool
    random: bool


def design(twins: Twins, data: Dataset, seed: int) -> NextRecord:
    """Ask for the next record within the limits of the twins, of the length that `next` chooses."""
    span, travel = (-twins.largest, twins.largest), (-twins.travel, twins.travel)
    return next_record(data, seed=seed, input_range=span, rate=1e9, travel=travel)


def is_open(twins: Twins, answer: NextRecord, truth: str, twin: str) -> bool:
    """Tell whether the answer leaves both twins as rivals."""
    if twins.nominal:
        return bool(answer.rivals) and answer.rivals[0][0].startswith("inertia")
    plants = [r.forecast.plant for question in answer.questions if len(question.rivals) > 1 for r in question.rivals]
    rivals = [{term.effect.name for term in plant.terms} for plant in plants]
    return any(truth in one for one in rivals) and any(twin in one for one in rivals)


def told(twins: Twins, data: Dataset, theirs: Dataset | None, truth: str, twin: str) -> bool:
    """Tell whether a diagnosis has the right answer."""
    answer = diagnose(data, views_too=False, simulated=theirs)
    if theirs is not None:
        linear = answer.findings.simulation.linear if answer.findings.simulation else ()
        wrong = {
            n.name.split()[0] for n in linear
            if not n.low <= n.simulated <= n.high and abs(n.value / n.simulated - 1) > MATTERS
        }  # fmt: skip
        return truth in wrong and twin not in wrong
    causes = {cause.effect: {s.effect for s in cause.confounded_with} for cause in answer.causes}
    return truth in causes and twin not in causes and twin not in causes[truth]


def after(twins: Twins, data: Dataset, seed: int, u: object) -> bool:
    """Take a record under u, and diagnose with it; a machine that runs away leaves no record."""
    truth, twin = twins.names(seed)

    def taken(machine: Machine, noise: float) -> Experiment:
        return machine.record(u, noise, (seed, STREAMS["new"]))

    try:
        record, theirs = taken(twins.machines[truth], twins.noise), None
    except UnusableInput:
        return False
    if twins.nominal:
        theirs = with_record(twins.at_hand(twins.nominal, seed, 0.0, twins.machines[truth]), taken(twins.nominal, 0.0))
    return told(twins, with_record(data, record), theirs, truth, twin)


def case(twins: Twins, seed: int) -> Case | None:
    """Try one seed; None where the records at hand decide already, or the truth is not among the rivals."""
    truth, twin = twins.names(seed)
    data = twins.at_hand(twins.machines[truth], seed)
    answer = design(twins, data, seed)
    if not is_open(twins, answer, truth, twin) or answer.design is None:
        return None
    u = answer.design.u[:, 0]
    of_random = after(twins, data, seed, twins.random_input(twins.machines[truth], u, seed))
    return Case(seed, truth, answer.design.chance, after(twins, data, seed, u), of_random)


def cases(twins: Twins, count: int) -> Iterator[Case]:
    """Go through the seeds until there are so many undecided cases."""
    seed = 0
    while count and seed < 1000:
        found = case(twins, seed)
        seed += 1
        if found is not None:
            count -= 1
            yield found


def main() -> None:
    """Print each case, and the table."""
    rows = []
    for name in sys.argv[2:] or PAIRS:
        begin, done = time.perf_counter(), []
        for one in cases(PAIRS[name], int(sys.argv[1])):
            done.append(one)
            print(name, one, f"{time.perf_counter() - begin:.0f} s", flush=True)
        seeds = done[-1].seed + 1
        rows.append((name, len(done), seeds, sum(c.designed for c in done), sum(c.random for c in done)))
    print("pair | undecided cases | of seeds | told after the designed record | after a random one")
    for row in rows:
        print(" | ".join(map(str, row)))


if __name__ == "__main__":
    main()
