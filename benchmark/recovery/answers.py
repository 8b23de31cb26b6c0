"""Answers of a tool to the cases in a folder: each case a piece of work for an engine, the answers one JSON file."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from simgap.data import load
from simgap.records import Status, UnusableInput
from simgap.recovery.drawing import CARD
from simgap.registry import ADAPTERS
from simgap.running.execution import Execution, carry_out
from simgap.running.fitting import reason
from simgap.running.source import closure


class Answer(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a tool says of a case: the causes in its order, or why it says nothing.

    A cause is a name, or a list of names among which it does not decide. `suspects` are names that it does not stand
    by; they are counted, but never as invented.
    """

    names: tuple[str | tuple[str, ...], ...] = ()
    suspects: tuple[str | tuple[str, ...], ...] = ()
    seconds: float = 0.0
    failed: str = ""


class Answers(msgspec.Struct, frozen=True, omit_defaults=True):
    """The content of an answers.json: `cases` is the digest on the card of the cases, `code` that of an adapter."""

    tool: str
    cases: str
    answers: dict[str, Answer]
    code: str = ""


class Card(msgspec.Struct, frozen=True):
    """The content of cases.json."""

    cases: str
    names: tuple[str, ...]
    effects: tuple[str, ...]


@dataclass(frozen=True)
class AnswerJob:
    """One case as work for an engine."""

    name: str
    folder: Path
    tool: str
    code_sha256: str
    gpus: float = 0.0

    @property
    def preload(self) -> tuple[str, ...]:
        """The adapter."""
        return (ADAPTERS.module(self.tool) or "simgap.recovery.answers",)

    def __str__(self) -> str:
        return self.name

    def execute(self) -> list[tuple[str, Answer]]:
        """Ask the tool; whatever it raises is its answer."""
        try:
            ask, dataset = ADAPTERS[self.tool], load(str(self.folder / self.name))
            begin = time.perf_counter()
            said = msgspec.convert(ask(dataset), Answer)
            return [(self.name, msgspec.structs.replace(said, seconds=time.perf_counter() - begin))]
        except BaseException as error:
            return self.failed("error", reason(self.tool, error))

    def failed(self, status: Status, message: str) -> list[tuple[str, Answer]]:
        """The answer that says why there is none."""
        return [(self.name, Answer(failed=f"{status}: {message}"))]

    def portable(self) -> AnswerJob:
        """The same with an absolute path."""
        return replace(self, folder=self.folder.absolute())

    def has_its_code(self) -> bool:
        """Whether the adapter is that of the digest."""
        return self.code_sha256 == _code(self.tool)


def answer(
    folder: str | Path,
    out: str | Path = "answers.json",
    tool: str = "simgap",
    execution: Execution | None = None,
    timeout: float = 600.0,
    memory: float = 8.0,
) -> Answers:
    """Let a tool answer all cases of a folder and write its answers to the file `out` as they come.

    Answers that are there already, by the same code to the same cases, are kept; what failed is asked again. `timeout`
    in seconds and `memory` in GiB are for one case. Raises UnusableInput.
    """
    folder, out, execution = Path(folder), Path(out), execution or Execution()
    card = _decoded(folder / CARD, Card, "make cases with `simgap recovery make`")
    ADAPTERS[tool]
    if not out.parent.is_dir() or out.is_dir():
        raise UnusableInput(f"{out} cannot be written: give a file in a folder that exists")
    answers = Answers(tool, card.cases, {}, _code(tool))
    if out.exists():
        stored = read_answers(out)
        if (stored.tool, stored.cases) != (tool, card.cases):
            raise UnusableInput(f"{out} holds answers of {stored.tool!r}, or to other cases; name another file")
        if stored.code == answers.code:
            answers = stored
    known = {name: said for name, said in answers.answers.items() if not said.failed}
    todo = [AnswerJob(name, folder, tool, answers.code) for name in card.names if name not in known]
    engine = replace(execution, out=out.parent).start(timeout, memory)

    def keep(rows: list[Any]) -> None:
        known.update(rows)
        text = msgspec.json.format(msgspec.json.encode(_ordered(answers, known)), indent=1)
        new = out.with_name(f".{out.name}.new")
        new.write_bytes(text + b"\n")
        new.replace(out)

    carry_out(engine, todo, keep, execution.listener)
    return _ordered(answers, known)


def read_answers(file: str | Path) -> Answers:
    """Read an answers.json. Raises UnusableInput that says what is wrong with it."""
    return _decoded(Path(file), Answers, "write it as docs/recovery.md says")


def _ordered(answers: Answers, known: dict[str, Answer]) -> Answers:
    return msgspec.structs.replace(answers, answers=dict(sorted(known.items())))


def _decoded(file: Path, kind: Any, remedy: str) -> Any:
    try:
        return msgspec.json.decode(file.read_bytes(), type=kind)
    except FileNotFoundError:
        raise UnusableInput(f"there is no file {file}; {remedy}") from None
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise UnusableInput(f"{file} cannot be read: {error}; {remedy}") from None


def _code(tool: str) -> str:
    module = ADAPTERS.module(tool)
    return closure({module: None}).sha256() if module else ""
