"""What is installed: one import name, all its files, the dependencies it declares, and none of our neighbours."""

import ast
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest
from floor_plan import FOLDERS, ROOT
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


def package_of(folder: Path) -> str:
    """baselines/estimation -> simgap.baselines.estimation"""
    top, *below = folder.relative_to(ROOT).parts
    return ".".join((FOLDERS[top], *below))


def files(*patterns: str) -> set[Path]:
    found = {path for folder in FOLDERS for pattern in patterns for path in (ROOT / folder).rglob(pattern)}
    return {path for path in found if path.is_file() and "__pycache__" not in path.parts}


def run(*command: object, **more) -> str:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=300, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_packages_are_the_folders_with_python_files():
    folders = {path.parent for path in files("*.py")}
    listed = PROJECT["tool"]["setuptools"]
    assert {package_of(folder) for folder in folders} == set(listed["packages"])
    assert {package_of(folder): str(folder.relative_to(ROOT)) for folder in folders} == listed["package-dir"]


def test_every_imported_package_is_declared_and_every_declared_one_imported():
    imported = set()
    for path in files("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(str(node.module).partition(".")[0])
    imported -= set(sys.stdlib_module_names) | {"simgap"}
    distributions = packages_distributions()
    names = {canonicalize_name(name) for module in imported for name in distributions.get(module, [module])}
    extras = PROJECT["project"]["optional-dependencies"]
    ours = [line for name, lines in extras.items() if name != "peers" for line in lines]
    declared = PROJECT["project"]["dependencies"] + ours
    assert names == {canonicalize_name(Requirement(line).name) for line in declared}


def test_the_lock_file_has_what_the_project_asks_for():
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pinned = [line.split("==") for line in lines if not line.startswith("#")]
    locked = {canonicalize_name(name): version for name, version in pinned}
    asked = [*PROJECT["project"]["dependencies"], *PROJECT["dependency-groups"]["dev"]]
    for requirement in map(Requirement, [*asked, *PROJECT["build-system"]["requires"]]):
        assert requirement.specifier.contains(locked[canonicalize_name(requirement.name)]), f"make lock: {requirement}"


@pytest.fixture(scope="module")
def wheels(tmp_path_factory) -> dict[str, Path]:
    """Ours, and that of a stranger whose top-level package is called baselines."""
    folder = tmp_path_factory.mktemp("wheels")
    for name in FOLDERS:  # a copy, because setuptools leaves files where it builds
        shutil.copytree(ROOT / name, folder / "simgap" / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / "simgap")
    (folder / "foreign" / "baselines").mkdir(parents=True)
    (folder / "foreign" / "baselines" / "__init__.py").write_text("OWNER = 'a stranger'\n")
    (folder / "foreign" / "pyproject.toml").write_text(
        '[build-system]\nrequires = ["setuptools"]\nbuild-backend = "setuptools.build_meta"\n'
        '[project]\nname = "foreign"\nversion = "1"\n[tool.setuptools]\npackages = ["baselines"]\n'
    )
    projects = (folder / "simgap", folder / "foreign")
    run(*PIP, "wheel", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", folder, *projects)
    return {path.name.partition("-")[0]: path for path in folder.glob("*.whl")}


def test_the_wheel_holds_every_file_under_one_name(wheels):
    results = ROOT / "reports" / "results"  # they stay in the repository
    code = {path for path in files("*") - files("*.md") if results not in path.parents}
    owed = {"/".join((*package_of(path.parent).split("."), path.name)) for path in code}
    with zipfile.ZipFile(wheels["simgap"]) as wheel:
        held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert held == owed
    assert "simgap/py.typed" in held


@pytest.mark.slow
def test_it_runs_in_a_clean_environment_beside_a_foreign_package_called_baselines(wheels, tmp_path):
    run(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    bin = tmp_path / "venv" / "bin"
    run(*PIP, "--python", bin / "python", "install", "--no-deps", "--no-index", *wheels.values())
    # The dependencies come from here. A folder named in a .pth file stands behind the environment's own packages, and
    # the .pth files in it, among them the one of an editable simgap, are not read.
    paths = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    site = Path(run(bin / "python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    (site / "dependencies.pth").write_text("\n".join(sorted(paths)) + "\n")

    where = "import baselines, simgap.baselines as ours; print(baselines.OWNER, ours.__file__, sep='\\n')"
    work = tmp_path / "elsewhere"
    work.mkdir()
    owner, file = run(bin / "python", "-c", where, cwd=work).splitlines()
    assert owner == "a stranger"
    assert Path(file).is_relative_to(site)

    rng = np.random.default_rng(0)
    np.savetxt(work / "my.csv", rng.normal(size=(400, 2)), delimiter=",", header="u,y", comments="")
    columns = ("--input", "u", "--output", "y", "--dt", "0.1")
    run(bin / "simgap", "run", "smoke", "--datasets", "my.csv", *columns, "--out", "results", cwd=work)
    printed = run(bin / "simgap", "report", "results", cwd=work)
    assert all(model in printed for model in ("mean", "hold", "ARX321"))
    assert "## Published" in (work / "results" / "leaderboard.md").read_text()
