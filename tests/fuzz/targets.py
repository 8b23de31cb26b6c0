"""Every way by which a stranger's bytes get into simgap: each ends in an answer or in one sentence of UnusableInput."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import simgap
from simgap.cli.options import parse_params
from simgap.data import load, save
from simgap.diagnosis.recovery import read as read_outcomes
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet, UnusableInput
from simgap.reports.leaderboard import report
from simgap.reports.regressions import to_text
from simgap.results import store
from simgap.results.regression import check
from simgap.running.suites import load_suite

LIVE = ("<script", "<img", "<iframe", "javascript:")


class Target(NamedTuple):
    """`feed` gives bytes to simgap in a folder of their own; `seeds` are good ones to start from."""

    feed: Callable[[bytes, Path], None]
    seeds: Callable[[Path], list[bytes]]


def try_it(target: Target, data: bytes, folder: Path) -> bool:
    """Whether the bytes were accepted. Anything but UnusableInput with one line is for the caller to see."""
    try:
        target.feed(data, folder)
    except UnusableInput as error:
        assert len(str(error).splitlines()) <= 1, str(error)
        return False
    return True


def small_dataset() -> Dataset:
    rng = np.random.default_rng(0)
    channels = Channels((Channel("u", "V"),), (Channel("y", "deg", "position"),))
    parts = [Experiment(name, rng.normal(size=(40, 1)), rng.normal(size=(40, 1)), 0.1) for name in "abc"]
    return Dataset("small", TrainingSet((parts[0],), (parts[1],), 4, channels), (parts[2],), 4, channels)


def feed_csv(data: bytes, folder: Path) -> None:
    (folder / "x.csv").write_bytes(data)
    load(str(folder / "x.csv"), inputs=["u"], outputs=["y"])


def csv_seeds(folder: Path) -> list[bytes]:
    rows = "".join(f"{i / 10},{(i * 7) % 5},{(i * 3) % 4}\n" for i in range(60))
    return [f"t,u,y\n{rows}".encode(), f"u;y;t\n{rows.replace(',', ';')}".encode(), b"\xef\xbb\xbf" + rows.encode()]


def feed_card(data: bytes, folder: Path) -> None:
    if not (folder / "small").exists():
        save(small_dataset(), folder / "small")
    (folder / "small" / "dataset.toml").write_bytes(data)
    found = load(str(folder / "small"))
    assert not any(c in found.name for c in "/\\<>&\0")


def card_seeds(folder: Path) -> list[bytes]:
    save(small_dataset(), folder / "seed")
    text = (folder / "seed" / "dataset.toml").read_bytes()
    shutil.rmtree(folder / "seed")
    return [text, text.replace(b"train/*.csv", b"../../*"), text.replace(b"small", b"a</script>")]


def feed_results(data: bytes, folder: Path) -> None:
    """Read, compared with itself, and shown as a leaderboard."""
    suite = folder / "results" / "smoke"
    suite.mkdir(parents=True, exist_ok=True)
    (suite / "m.jsonl").write_bytes(data)
    rows = store.read(suite)
    written = report(folder / "results")
    shown = written.markdown.read_text(encoding="utf-8")
    if rows:
        shown += to_text(check(folder / "results", folder / "results"))
    assert not any(tag in shown.lower() for tag in LIVE)
    for row in rows:
        assert store.path_of(folder, "smoke", row.model).parent == folder / "smoke"
        json.loads(store.encode(row))


def result_seeds(folder: Path) -> list[bytes]:
    done = simgap.fit("arx", small_dataset(), {"na": 1, "nb": 1, "nk": 1})
    lines = [store.encode(row) for row in done.results]
    evil = lines[0].replace('"small"', '"<script>alert(1)</script>|`x`"')
    return ["\n".join(lines).encode() + b"\n", evil.encode(), lines[0].encode()[:-20]]


def feed_suite(data: bytes, folder: Path) -> None:
    (folder / "mine.toml").write_bytes(data)
    load_suite(str(folder / "mine.toml"))


def suite_seeds(folder: Path) -> list[bytes]:
    text = b'title = "x"\ndatasets = ["gimbal"]\nseeds = 2\ntimeout = 3\nmemory = 1.5\n'
    return [
        text + b'[[models]]\nname = "arx"\nlabel = "A"\nparams = { na = 2 }\ngpus = 0.5\n[[models]]\nname = "all"\n'
    ]


def saved(folder: Path, model: str, **params: int) -> bytes:
    """A fitted model as a file holds it."""
    data = small_dataset()
    simgap.save_model(simgap.fit(model, data, params).model, folder / "model", data)
    return (folder / "model").read_bytes()


def saved_seeds(folder: Path) -> list[bytes]:
    network = saved(folder, "gru", units=2, epochs=1, batches=1)
    return [network, saved(folder, "arx", na=1, nb=1), saved(folder, "greybox")]


def feed_saved(data: bytes, folder: Path) -> None:
    (folder / "model").write_bytes(data)
    simgap.load_model(folder / "model")


def feed_outcomes(data: bytes, folder: Path) -> None:
    (folder / "o.jsonl").write_bytes(data)
    list(read_outcomes(folder / "o.jsonl"))


def feed_params(data: bytes, folder: Path) -> None:
    parse_params([data.decode("utf-8", "replace")])


TARGETS = {
    "csv": Target(feed_csv, csv_seeds),
    "card": Target(feed_card, card_seeds),
    "results": Target(feed_results, result_seeds),
    "suite": Target(feed_suite, suite_seeds),
    "saved": Target(feed_saved, saved_seeds),
    "outcomes": Target(feed_outcomes, lambda folder: [b"{}\n", b'{"case": {}, "answer": []}\n']),
    "params": Target(feed_params, lambda folder: [b"na=3", b"x=[1, {a = 2}]", b"d=1979-05-27", b'e="\\u0041"']),
}
