"""A model of one's own: the template works as it is, and what is wrong with a model is said in words."""

import json

import pytest

import simgap
from simgap.cli import main

BROKEN = """
from dataclasses import replace
import numpy as np

class Base:
    "A first-order model that is right."
    def fit(self, data, seed):
        past = np.concatenate([np.hstack((e.y[:-1], e.u[:-1])) for e in data.train])
        now = np.concatenate([e.y[1:] for e in data.train])
        self.theta = np.linalg.lstsq(past, now, rcond=None)[0]

    def simulate(self, u, y_init):
        y = [y_init[:, -1]]
        for k in range(y_init.shape[1], u.shape[1]):
            y.append(np.einsum("bi,ij->bj", np.concatenate((y[-1], u[:, k - 1]), axis=1), self.theta))
        return np.stack(y[1:], axis=1)

class LooksAhead(Base):
    "Uses the input of later samples."
    def simulate(self, u, y_init):
        return super().simulate(u, y_init) + u.mean(axis=1, keepdims=True)

class Mixes(Base):
    "Depends on the experiments beside it."
    def simulate(self, u, y_init):
        return super().simulate(u, y_init) + y_init.mean()

class Remembers(Base):
    "Starts from what it was."
    def fit(self, data, seed):
        before = getattr(self, "theta", 0.0)
        super().fit(data, seed)
        self.theta = self.theta + 0.01 * before

class Draws(Base):
    "Takes its randomness from nowhere."
    def fit(self, data, seed):
        super().fit(data, seed)
        self.theta = self.theta * (1 + 0.01 * np.random.default_rng().random())

class Deaf(Base):
    "Hears no input."
    def simulate(self, u, y_init):
        return super().simulate(0 * u, y_init)

class Single(Base):
    "float32."
    def simulate(self, u, y_init):
        return super().simulate(u, y_init).astype("f4")

class Writes(Base):
    "Writes into its argument."
    def simulate(self, u, y_init):
        u -= u.mean()
        return super().simulate(u, y_init)

class Raises(Base):
    "Fails."
    def fit(self, data, seed):
        raise ValueError("no idea")

class Nameless(Base):
    def fit(self, data, seed):
        super().fit(data, seed)

class Counts(Base):
    "n_params is no number."
    n_params = "many"

class Guesses(Base):
    "stochastic is no yes or no."
    stochastic = 0.3

class Refits(Base):
    "Estimates on validation data and does not say so."
    def fit(self, data, seed):
        super().fit(replace(data, train=data.train + data.valid), seed)

class NeedsMany(Base):
    "Wants two samples to start."
    def simulate(self, u, y_init):
        y_init[:, -2]
        return super().simulate(u, y_init)
"""


@pytest.fixture
def broken(tmp_path):
    (tmp_path / "broken.py").write_text(BROKEN)
    return tmp_path / "broken.py"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("LooksAhead", "simulate looks ahead"),
        ("Mixes", "an experiment is simulated differently when others stand beside it"),
        ("Remembers", "fit must start from nothing"),
        ("Draws", "take all randomness from seed"),
        ("Deaf", "the same without any input"),
        ("Single", "it returned float32 values, where float64 was asked for"),
        ("Writes", "it changed its argument u in place"),
        ("Raises", "fit raised ValueError: no idea (broken.py, line "),
        ("Nameless", "the class has no docstring"),
        ("Counts", "n_params is 'many'"),
        ("Guesses", "stochastic is 0.3; make it True"),
        ("Refits", "it needs a method as_chosen"),
        ("NeedsMany", "simulate raised IndexError"),
    ],
)
def test_try_model_says_what_is_wrong(broken, name, words, capsys):
    assert main(["try-model", f"{broken}:{name}"]) == 1
    printed = capsys.readouterr().out
    (line,) = [line for line in printed.splitlines() if words in line][:1]
    assert line.startswith("WRONG  ")


def test_try_model_passes_what_is_right(broken, capsys, tmp_path):
    assert main(["try-model", f"{broken}:Base", "--json", str(tmp_path / "told.json")]) == 0
    printed = capsys.readouterr().out
    assert "WRONG" not in printed
    assert "13 of 13 checks passed" in printed
    assert not any(check["wrong"] for check in json.loads((tmp_path / "told.json").read_text())["checks"])


@pytest.mark.parametrize(
    ("reference", "complaint"),
    [
        ("nosuch", "there is no model called 'nosuch'"),
        ("nosuch.py", "there is no file nosuch.py"),
        ("broken.py", "the file holds the classes Base, LooksAhead"),
        ("broken.py:Nosuch", "holds no class Nosuch"),
    ],
)
def test_try_model_refuses_what_is_no_model(broken, monkeypatch, capsys, reference, complaint):
    monkeypatch.chdir(broken.parent)
    assert main(["try-model", reference]) == 2
    assert complaint in capsys.readouterr().err


def test_the_template_keeps_the_contract_and_gets_its_row(tmp_path, monkeypatch, capsys, folder):
    monkeypatch.chdir(tmp_path)
    assert main(["new-model", "my_model"]) == 0
    assert "simgap try-model my_model.py" in capsys.readouterr().out
    assert main(["try-model", "my_model.py"]) == 0
    (row, *_) = simgap.run("smoke", model=["my_model.py:MyModel"], datasets=[str(folder)], out=tmp_path / "out")
    assert (row.model, row.status, row.fitted) == ("MyModel", "ok", {"order": 2})


@pytest.mark.parametrize("name", ["arx", "My-Model", "class", "", "../up", "a" * 41])
def test_new_model_refuses_a_name_that_cannot_be_one(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    assert main(["new-model", name]) == 2
    assert list(tmp_path.iterdir()) == []
    assert capsys.readouterr().err.startswith("simgap: ")


def test_new_model_leaves_a_file_that_is_there_as_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("precious")
    assert main(["new-model", "mine"]) == 2
    assert (tmp_path / "mine.py").read_text() == "precious"
    assert "was left as it is" in capsys.readouterr().err
    assert main(["new-model", "other", "--folder", "nosuch"]) == 2
