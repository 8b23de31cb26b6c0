"""`import simgap` and what only lists names load little: no model, no torch."""

import os
import subprocess
import sys

import pytest

HEAVY = {"control", "jaxtyping", "numba", "numpy", "pandas", "rich", "scipy", "torch", "typer"}


def test_import_simgap_loads_nothing_heavy():
    code = "import sys, simgap; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True)
    assert not HEAVY & set(done.stdout.split())


def test_python_runs_the_command_line_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "simgap", "list", "suites"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "full" in done.stdout
    wrong = subprocess.run([sys.executable, "-m", "simgap", "lst"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("simgap: ")


@pytest.mark.parametrize("arguments", ["", "--help", "--version", "list models", "list datasets", "list suites"])
def test_a_command_that_fits_nothing_does_not_import_torch(arguments, tmp_path):
    # Nothing catches this, whereas an ImportError could be taken for a missing dependency.
    (tmp_path / "torch.py").write_text("import os\nos._exit(77)\n")
    command = [sys.executable, "-W", "error", "-m", "simgap", *arguments.split()]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout
