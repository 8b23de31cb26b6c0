"""Rates of right and invented names: the answers of tools against what a seed hides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from pathlib import Path
from statistics import mean, median
from typing import Any

from simgap.diagnosis.cases import Case
from simgap.records import UnusableInput
from simgap.recovery.answers import Answer, Answers, read_answers
from simgap.recovery.drawing import MOST_CASES, digest, draw, effects

NO_ANSWER = Answer(failed="no answer")
Named = tuple[str | tuple[str, ...], ...]


def score(files: Sequence[str | Path], seed: str) -> dict[str, Any]:
    """Count what the answers in `files` get right, one tool each, against the cases of `seed`.

    A rate is [how many, of how many]; a failure, or a case without an answer, is not right and stays in the count.
    Raises UnusableInput, also for answers to the cases of another seed.
    """
    tools: dict[str, Any] = {}
    known: dict[str, Case] = {}
    for file in files:
        answers = read_answers(file)
        cases = _cases(answers, seed, str(file))
        if (known and cases != known) or answers.tool in tools:
            raise UnusableInput(f"{file}: the files must answer the same cases, each in the name of another tool")
        known = cases
        tools[answers.tool] = rates(cases, answers.answers)
    if not tools:
        raise UnusableInput("give at least one file of answers")
    return {"schema": 1, "seed": seed, "cases": len(known), "tools": tools}


def rates(cases: Mapping[str, Case], answers: Mapping[str, Answer]) -> dict[str, Any]:
    """Rates of one tool over all cases, its failures by reason, and its seconds for a case that it answers."""
    known = set(effects())
    asked = [(list(case.hidden()), answers.get(name, NO_ANSWER)) for name, case in cases.items()]
    single = [(hidden[0], said) for hidden, said in asked if len(hidden) == 1 and hidden[0] in known]
    pairs = [(hidden, said) for hidden, said in asked if len(hidden) == 2]
    clean = [said for hidden, said in asked if not hidden]
    outside = [said for hidden, said in asked if len(hidden) == 1 and hidden[0] not in known]
    by_effect: dict[str, list[int]] = {}
    for effect, said in single:
        right, total = by_effect.get(effect, [0, 0])
        by_effect[effect] = [right + _first_is(effect, said), total + 1]
    sizes = [len(_sets(said.names)[0]) for _, said in asked if said.names]
    seconds = [said.seconds for _, said in asked if not said.failed]
    reasons = [said.failed for _, said in asked if said.failed]
    return {
        "first_right": _rate([_first_is(effect, said) for effect, said in single]),
        "among_first": _rate([_among_first(effect, said.names) for effect, said in single]),
        "only_suspected": _rate([not said.names and _among_first(effect, said.suspects) for effect, said in single]),
        "wrong_name": _rate([any(effect not in s for s in _sets(said.names)) for effect, said in single]),
        "both_of_pair": _rate([_both(hidden, said.names) for hidden, said in pairs]),
        "invented_on_clean": _rate([bool(said.names) for said in clean]),
        "invented_outside": _rate([bool(said.names) for said in outside]),
        "failed": [len(reasons), len(asked)],
        "failures": {reason: reasons.count(reason) for reason in sorted(set(reasons))},
        "names_per_first": mean(sizes) if sizes else None,
        "median_seconds": median(seconds) if seconds else None,
        "longest_seconds": max(seconds, default=None),
        "by_effect": dict(sorted(by_effect.items())),
    }


def _cases(answers: Answers, seed: str, file: str) -> dict[str, Case]:
    """Draw the cases again that were answered. Raises UnusableInput for those of another seed and for unknown names."""
    count = answers.cases.partition("-")[0]
    cases = draw(seed, int(count)) if count.isdecimal() and 0 < int(count) <= MOST_CASES else {}
    if digest(seed, cases) != answers.cases:
        raise UnusableInput(f"{file} answers the cases of another seed, or of another version of simgap")
    if strangers := sorted(set(answers.answers) - set(cases)):
        raise UnusableInput(f"{file}: there is no case called {strangers[0]!r}")
    for name, said in answers.answers.items():
        for listed in (*_sets(said.names), *_sets(said.suspects)):
            if not listed or set(listed) - set(effects()):
                text = f"{file}: {name} names {list(listed)}, which is not among the effects of cases.json"
                raise UnusableInput(text)
    return cases


def _sets(names: Named) -> list[tuple[str, ...]]:
    return [(name,) if isinstance(name, str) else name for name in names]


def _first_is(effect: str, said: Answer) -> bool:
    """Whether the first name is right; of names among which a tool does not decide, the first."""
    return bool(said.names) and _sets(said.names)[0][0] == effect


def _among_first(effect: str, names: Named) -> bool:
    return bool(names) and effect in _sets(names)[0]


def _both(hidden: Sequence[str], names: Named) -> bool:
    """Whether the first two causes hold one hidden effect each."""
    first = _sets(names)[:2]
    return len(first) == 2 and any(
        all(effect in s for effect, s in zip(order, first, strict=True)) for order in permutations(hidden)
    )


def _rate(good: Sequence[bool]) -> list[int]:
    return [sum(good), len(good)]
