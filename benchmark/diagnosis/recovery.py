"""`simgap run hide-and-seek`: hide effects in simulated rigs, diagnose, and count what was found."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from simgap.records import Dataset, UnusableInput
from simgap.running.workers import Limits, prepare_worker, threads_per_worker

FILE = Path("hide-and-seek") / "cases.jsonl"
# What an oracle that is told the effect must gain for the effect to count as visible.
VISIBLE_GAIN = 0.03  # of the squared error on the test experiments
VISIBLE_RATIO = 15.0  # log-likelihood


@dataclass(frozen=True)
class Case:
    """What is hidden where: effects, comma-separated, with one strength; noise and its colour; the seed of the data."""

    rig: str
    effects: str
    strength: float
    noise: float
    colour: float
    seed: int

    def hidden(self) -> dict[str, float]:
        """Effect to strength."""
        return dict.fromkeys(self.effects.split(","), self.strength) if self.effects else {}


@dataclass(frozen=True)
class Outcome:
    """One case: what an oracle sees, and what the diagnosis said."""

    case: Case
    visible: bool
    oracle_gain: float  # share of the squared error on the test experiments
    oracle_ratio: float  # log-likelihood ratio in training
    verdict: str
    named: tuple[str, ...]
    confounded: tuple[tuple[str, ...], ...]
    gain: float
    seconds: float
    error: str = ""

    @property
    def right(self) -> bool:
        """Whether the answer is right: nothing for nothing, unexplained for what no catalogue holds, else the name.

        A pair that is said to be confounded is right if the truth is in it. Of two effects both must be named.
        """
        from simgap.registry import EFFECTS

        hidden = self.case.effects.split(",") if self.case.effects else []
        if not hidden:
            return self.verdict == "nothing_found"
        if any(name not in EFFECTS for name in hidden):
            return self.verdict == "unexplained"
        answers = [{name, *others} for name, others in zip(self.named, self.confounded, strict=True)]
        if len(hidden) == 1:
            return bool(answers) and hidden[0] in answers[0]
        return all(any(name in answer for answer in answers) for name in hidden)


def hide_and_seek(
    rigs: Sequence[str] = (),
    strengths: Sequence[float] = (1.0, 0.5, 0.25),
    noises: Sequence[float] = (0.02, 0.05, 0.2),
    colours: Sequence[float] = (0.0,),
    pairs: int = 60,
    clean: int = 300,
    seeds: int = 1,
    jobs: int = 1,
    out: str | Path = "results",
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> list[Outcome]:
    """Every effect on every rig that it suits, `pairs` of two at once, and `clean` rigs with nothing hidden.

    Outcomes are stored one by one; a second call runs what is missing. Raises UnusableInput for an unknown rig.
    """
    cases = list(plan(rigs, strengths, noises, colours, pairs, clean, seeds))
    file = Path(out) / FILE
    known = {outcome.case: outcome for outcome in read(file)}
    todo = [case for case in cases if case not in known]
    file.parent.mkdir(parents=True, exist_ok=True)
    tell(len(cases) - len(todo), len(cases))
    if todo:
        workers = min(jobs, len(todo))
        context = multiprocessing.get_context("spawn")
        limits = Limits(threads_per_worker(workers))
        with (
            ProcessPoolExecutor(workers, context, prepare_worker, (limits,)) as pool,
            file.open("a", encoding="utf-8") as lines,
        ):
            try:
                for future in as_completed([pool.submit(seek, case) for case in todo]):
                    outcome = future.result()
                    known[outcome.case] = outcome
                    lines.write(json.dumps(asdict(outcome)) + "\n")
                    lines.flush()
                    tell(sum(case in known for case in cases), len(cases))
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    return [known[case] for case in cases]


def plan(
    rigs: Sequence[str],
    strengths: Sequence[float],
    noises: Sequence[float],
    colours: Sequence[float],
    pairs: int,
    clean: int,
    seeds: int,
) -> Iterator[Case]:
    """All cases; the seed of a case depends on nothing but its place."""
    from simgap.data.simulated.rigs import RIGS, suitable

    chosen = tuple(rigs) or tuple(RIGS)
    for rig in chosen:
        if rig not in RIGS:
            raise UnusableInput(f"there is no rig called {rig!r}; known are {', '.join(RIGS)}")
    for seed in range(seeds):
        for rig in chosen:
            for effect in (*suitable(rig), *suitable(rig, outside=True)):
                for strength in strengths:
                    for noise in noises:
                        for colour in colours:
                            yield Case(rig, effect, float(strength), float(noise), float(colour), seed)
    rng = np.random.default_rng(1)
    for i in range(pairs):
        rig = str(rng.choice(chosen))
        both = sorted(map(str, rng.choice(suitable(rig), 2, replace=False)))
        yield Case(rig, ",".join(both), 1.0, 0.05, 0.0, 1000 + i)
    for i in range(clean):
        rig = chosen[i % len(chosen)]
        yield Case(rig, "", 0.0, (0.02, 0.05, 0.1, 0.2)[i // 3 % 4], (0.0, 0.6, 0.9)[i % 3], 5000 + i)


def read(file: Path) -> Iterator[Outcome]:
    """The stored outcomes; a line that was torn by a crash is run again."""
    for line in file.read_bytes().splitlines() if file.is_file() else ():
        try:
            row = json.loads(line)
            yield Outcome(**(row | {
                "case": Case(**row["case"]), "named": tuple(row["named"]),
                "confounded": tuple(map(tuple, row["confounded"])),
            }))  # fmt: skip
        except (ValueError, TypeError, KeyError, RecursionError):
            continue


def seek(case: Case) -> Outcome:
    """Make the data, ask the oracle, diagnose."""
    from simgap.data.simulated.rigs import hide
    from simgap.diagnosis.diagnose import diagnose

    dataset = hide(case.rig, case.hidden(), case.noise, case.colour, case.seed)
    try:
        gain, ratio = oracle(dataset, tuple(case.hidden()))
        answer = diagnose(dataset, views_too=False)
    except Exception as error:  # a row of the table, like a model that fails
        return Outcome(case, False, 0.0, 0.0, "error", (), (), 0.0, 0.0, f"{type(error).__name__}: {error}")
    before, after = answer.findings.gain.before, answer.findings.gain.after
    name = next(iter(before))
    return Outcome(
        case,
        gain > VISIBLE_GAIN and ratio > VISIBLE_RATIO,
        gain,
        ratio,
        answer.verdict,
        tuple(cause.effect for cause in answer.causes),
        tuple(tuple(s.effect for s in cause.confounded_with) for cause in answer.causes),
        1 - (after[name] / before[name]) ** 2,
        answer.seconds,
    )


def oracle(dataset: Dataset, hidden: Sequence[str]) -> tuple[float, float]:
    """What the grey box gains that is told the effects: share of the squared test error, and log-likelihood ratio."""
    from simgap.diagnosis import gains
    from simgap.registry import EFFECTS, MODELS

    if not hidden or any(name not in EFFECTS for name in hidden):
        return (1.0, np.inf) if hidden else (0.0, 0.0)  # what is outside the catalogue is taken to be visible
    squares, likelihood = [], []
    for effects in ((), tuple(hidden)):
        model: Any = MODELS["greybox"](effects=effects)
        model.fit(dataset.training, 0)
        runs = [
            model.simulate_anew(x, dataset.n_init) if effects else gains.free_run(model, x, dataset.n_init)
            for x in dataset.test
        ]
        errors = [
            np.sum((x.y[dataset.n_init :, 0] - run[:, 0]) ** 2) for x, run in zip(dataset.test, runs, strict=True)
        ]
        squares.append(sum(errors))
        likelihood.append(model.log_likelihood())
    ratio = likelihood[1] - likelihood[0] + sum(off.log_likelihood_ratio for p in model.plants for off in p.outliers)
    return float(1 - squares[1] / squares[0]), float(ratio)
