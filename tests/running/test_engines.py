"""An engine registers like a model: one file, no other edit."""

import sys
from inspect import signature

import pytest

import simgap
from simgap.cli import main
from simgap.records import UnusableInput
from simgap.registry import ENGINES
from simgap.running.execution import Execution

FILE = '''
from dataclasses import dataclass
from simgap.registry import ENGINES

@ENGINES.register("in-turn")
@dataclass(frozen=True)
class InTurn:
    """In this process, one after the other."""

    workers: int
    limits: object
    queue: str = ""

    @staticmethod
    def threads(workers):
        return 1

    def __call__(self, todo):
        for work in todo:
            yield work.execute()
'''


@pytest.fixture
def third(tmp_path, monkeypatch):
    """An engine of one file, in a package that the registry scans."""
    package = tmp_path / "their_engines"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "in_turn.py").write_text(FILE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(ENGINES, "packages", (*ENGINES.packages, "their_engines"))
    monkeypatch.setattr(ENGINES, "_entries", None)
    yield
    ENGINES._found.pop("in-turn", None)
    sys.modules.pop("their_engines.in_turn", None)
    ENGINES._entries = None


def test_a_third_engine_is_one_file(third, suite, tmp_path, example):
    assert main(["run", suite("Mean"), "--engine", "in-turn", "--out", str(tmp_path / "out")]) == 0
    alone = simgap.run(suite("Mean"), out=tmp_path / "alone")
    rows = simgap.run(suite("Mean"), engine="in-turn", out=tmp_path / "out")
    assert [(row.status, row.metrics) for row in rows] == [(row.status, row.metrics) for row in alone]


def test_an_option_is_refused_where_the_engine_takes_none(third, tmp_path):
    def start(engine, **options):
        return Execution(engine, options=options, out=tmp_path).start(1.0, 1.0)

    assert start("in-turn", queue="long").queue == "long"
    with pytest.raises(UnusableInput, match="--queue is for --engine in-turn: the engine local takes none"):
        start("local", queue="long")
    with pytest.raises(UnusableInput, match="--address is for --engine ray: the engine in-turn takes none"):
        start("in-turn", address="host:1")


def test_every_engine_is_made_of_workers_and_limits_and_says_its_threads():
    for name in ENGINES:
        assert list(signature(ENGINES[name]).parameters)[:2] == ["workers", "limits"]
        assert ENGINES[name].threads(1000) == 1
