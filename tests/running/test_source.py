"""The digest of a model's code: what it covers, and what it leaves alone."""

from pathlib import Path

import floor_plan
import pytest

from simgap.registry import EFFECTS, MODELS
from simgap.running import source
from simgap.running.fitting import model_class
from simgap.running.jobs import model_code
from simgap.running.suites import Entry


def modules(name, **params):
    return set(model_code(Entry(name, params)).digests)


@pytest.mark.parametrize(
    ("model", "module"),
    [
        ("greybox-auto", "simgap.baselines.greybox"),
        ("greybox-auto", "simgap.greybox.selection"),
        ("greybox-auto", EFFECTS.module("stribeck_friction")),
        ("inception_regularised", "simgap.neural.inception"),
        ("gru", "simgap.neural.training.network"),
        ("delta", "simgap.baselines.arx"),  # its default
    ],
)
def test_the_digest_covers_what_the_model_imports_or_reaches_through_a_registry(model, module):
    assert module in modules(model)


def test_the_digest_leaves_out_what_the_model_does_not_import():
    assert modules("mean") == {"simgap.baselines.mean"}
    assert not any(name.startswith(("simgap.greybox", "simgap.neural")) for name in modules("arx"))
    for name in MODELS:
        assert not modules(name) & {*source.CONTRACT_MODULES, "simgap.running.fitting"}, name


def test_models_that_parameters_name_are_covered_at_any_depth():
    assert "simgap.neural.gru" in modules("delta", model="gru")
    assert "simgap.neural.gru" in modules("delta", model="delta", params={"model": "gru"})


def test_an_edit_changes_the_digests_of_those_that_use_it_and_no_other(monkeypatch):
    names = ("mean", "arx", "greybox", "greybox-auto", "informed", "inception", "inception_regularised")

    def edited(module):
        honest = source._read

        def read(name, *rest):
            found = honest(name, *rest)
            return source._Module("0" * 64, found.imported) if name == module else found

        with monkeypatch.context() as patch:
            before = {name: model_code(Entry(name)).sha256() for name in names}
            patch.setattr(source, "_read", read)
            return {name for name in names if model_code(Entry(name)).sha256() != before[name]}

    assert edited("simgap.greybox.simulation") == {"greybox", "greybox-auto", "informed"}
    assert edited(EFFECTS.module("backlash")) == {"greybox", "greybox-auto", "informed"}
    assert edited("simgap.baselines.greybox_auto") == {"greybox-auto", "informed"}
    assert edited("simgap.neural.inception") == {"inception", "inception_regularised"}


USERS = {
    "mine.py": "def late():\n    from layers import deep\n\nclass Mine:\n    if True: import sums\n",
    "layers/__init__.py": "",
    "layers/deep.py": "import numpy\nfrom . import wide\nfrom simgap.neural.training.scaling import Scaling\n",
    "layers/wide.py": '"""A text\nfrom nowhere at all (\n"""\nfrom typing import TYPE_CHECKING\nimport twice\n'
    "if TYPE_CHECKING:\n    import unused\n",
    "sums.py": "",
    "twice.py": "import mine\n",
    "unused.py": "",
}


@pytest.fixture
def mine(tmp_path):
    for name, text in USERS.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_of_a_users_file_the_modules_beside_it_and_those_of_simgap_are_covered(mine):
    code = source.closure({"mine": mine / "mine.py"}, root=mine)
    assert set(code.digests) == {
        "mine", "layers", "layers.deep", "layers.wide", "sums", "twice", "simgap.neural.training.scaling",
    }  # fmt: skip
    assert "numpy" in code.outside


@pytest.mark.parametrize("name", ["mine.py", "layers/wide.py", "sums.py"])
def test_an_edit_of_a_users_file_is_seen_and_its_place_is_not(mine, name, tmp_path_factory):
    before = source.closure({"mine": mine / "mine.py"}, root=mine).sha256()
    moved = tmp_path_factory.mktemp("elsewhere") / "moved"
    mine.rename(moved)
    assert source.closure({"mine": moved / "mine.py"}, root=moved).sha256() == before
    (moved / name).write_text((moved / name).read_text() + "# edited\n")
    assert source.closure({"mine": moved / "mine.py"}, root=moved).sha256() != before


def test_other_packages_beside_an_installed_one_are_not_followed(tmp_path):
    folder = tmp_path / "site-packages"
    for name, text in {"theirs/models.py": "import theirs.parts, numpy", "theirs/parts.py": "", "numpy.py": ""}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    code = source.closure({"theirs.models": folder / "theirs" / "models.py"}, root=folder)
    assert (set(code.digests), code.outside) == ({"theirs.models", "theirs.parts"}, {"numpy"})


def test_the_digests_of_all_models_read_each_file_once():
    classes = [model_class(name) for name in MODELS]
    source._read.cache_clear()
    for kind in classes:
        source.code_of([kind]).sha256()
    assert source._read.cache_info().misses <= len(floor_plan.modules())


def test_every_module_of_simgap_is_found_by_its_name():
    for name, path in floor_plan.modules().items():
        assert source._of_simgap(name).samefile(path), name
    assert source._of_simgap("simgap.nosuch") is None
    assert isinstance(source._of_simgap("simgap.records"), Path)


def test_two_models_of_one_file_are_told_apart(tmp_path):
    file = tmp_path / "two.py"
    methods = "    def fit(self, data, seed): ...\n    def simulate(self, u, y_init): ...\n"
    file.write_text(f"class One:\n{methods}\n\nclass Other:\n{methods}")
    one, other = (model_code(Entry(f"{file}:{name}", {}, "mine")).sha256() for name in ("One", "Other"))
    assert one != other
