"""The recovery study, `simgap run recovery`: hide effects in simulated rigs and count what a diagnosis names."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path

import msgspec
import numpy as np

from simgap.diagnosis.cases import Case, CaseResult, room_of, solve
from simgap.records import Status, UnusableInput
from simgap.results import lines, store
from simgap.running.execution import Execution, carry_out
from simgap.running.fitting import reason
from simgap.running.source import closure

FILE = Path("recovery") / "cases.jsonl"
# The code that decides a case; where it changes, stored cases are computed again.
ROOMS = (
    "diagnosis", "error_views", "findings", "metrics", "greybox", "baselines", "subspace", "known_plant", "units",
    "data.simulated",
)  # fmt: skip


@dataclass(frozen=True)
class Grid:
    """The cases of a study: every effect on every rig that it suits with each strength, noise and colour, `pairs` of
    two effects at once, and `clean` rigs with nothing hidden. No rigs: all test rigs; machines in the field by name.
    """

    rigs: tuple[str, ...] = ()
    strengths: tuple[float, ...] = (1.0, 0.5, 0.25)
    noises: tuple[float, ...] = (0.02, 0.05, 0.2)
    colours: tuple[float, ...] = (0.0,)
    pairs: int = 60
    clean: int = 300
    seeds: int = 1

    def cases(self) -> Iterator[Case]:
        """All cases; the seed of a case depends on nothing but its place. Raises UnusableInput for an unknown rig."""
        from simgap.data.simulated import field, rigs

        known = (*rigs.RIGS, *field.RIGS)
        chosen = self.rigs or tuple(rigs.RIGS)
        for rig in chosen:
            if rig not in known:
                raise UnusableInput(f"there is no rig called {rig!r}; known are {', '.join(known)}")

        def suitable(rig: str, outside: bool = False) -> tuple[str, ...]:
            return room_of(rig).suitable(rig, outside)

        for seed, rig in product(range(self.seeds), chosen):
            effects = (*suitable(rig), *suitable(rig, outside=True))
            for effect, strength, noise, colour in product(effects, self.strengths, self.noises, self.colours):
                yield Case(rig, effect, strength, noise, colour, seed)
        rng = np.random.default_rng(1)
        for i in range(self.pairs):
            rig = str(rng.choice(chosen))
            both = sorted(map(str, rng.choice(suitable(rig), 2, replace=False)))
            yield Case(rig, ",".join(both), 1.0, 0.05, 0.0, 1000 + i)
        for i in range(self.clean):
            rig = chosen[i % len(chosen)]
            yield Case(rig, "", 0.0, (0.02, 0.05, 0.1, 0.2)[i // 3 % 4], (0.0, 0.6, 0.9)[i % 3], 5000 + i)


@dataclass(frozen=True)
class CaseJob:
    """One case as work for an engine."""

    case: Case
    code_sha256: str
    preload: tuple[str, ...] = ("simgap.diagnosis.recovery",)
    gpus: float = 0.0

    def __str__(self) -> str:
        return str(self.case)

    def execute(self) -> list[CaseResult]:
        """Diagnose; whatever is raised becomes the row."""
        try:
            return [replace(solve(self.case), code_sha256=self.code_sha256)]
        except BaseException as error:
            return self.failed("error", reason("the diagnosis", error))

    def failed(self, status: Status, message: str) -> list[CaseResult]:
        """The row that says why there is no answer."""
        return [CaseResult(self.case, status, message, code_sha256=self.code_sha256)]

    def portable(self) -> CaseJob:
        """A case names no files."""
        return self

    def has_its_code(self) -> bool:
        """Whether rigs and diagnosis are those of the digest."""
        return self.code_sha256 == code_sha256()


def recovery(
    grid: Grid | None = None, execution: Execution | None = None, timeout: float = 600.0, memory: float = 8.0
) -> list[CaseResult]:
    """The results of all cases, those stored by an earlier call with the same code included.

    `timeout` in seconds and `memory` in GiB are for one case. A case that raises, hangs or ends its process is a
    result with its reason, and is computed again by the next call. Raises UnusableInput.
    """
    execution = execution or Execution()
    cases = list((grid or Grid()).cases())
    engine = execution.start(timeout, memory)
    file = store.writable(execution.out) / FILE
    digest = code_sha256()
    known = {row.case: row for row in read(file) if row.status == "ok" and row.code_sha256 == digest}
    todo = [CaseJob(case, digest) for case in cases if case not in known]
    if len(todo) < len(cases):
        execution.send(f"{len(cases) - len(todo)} of {len(cases)} cases are done already and were not run again")

    def keep(rows: Sequence[CaseResult]) -> None:
        text = "".join(json.dumps(store.plain(asdict(row)), allow_nan=False) + "\n" for row in rows)
        lines.append(file, text.encode(), store.lock_of(execution.out))

    for rows in carry_out(engine, todo, keep, execution.listener):
        known |= {row.case: row for row in rows}
    return [known[case] for case in cases]


def read(file: Path) -> Iterator[CaseResult]:
    """The stored results; a line that is none, such as one torn by a crash, is left out and so computed again."""
    for line in lines.read(file) if file.is_file() else ():
        try:
            yield msgspec.json.decode(line, type=CaseResult)
        except (msgspec.MsgspecError, ValueError, RecursionError):
            continue


@cache
def code_sha256() -> str:
    """Digest of the code that decides a case: rigs, grey box, effects and diagnosis."""
    within = tuple(f"simgap.{room}" for room in ROOMS)
    return closure({"simgap.diagnosis.cases": None}, within=within).sha256()
