"""The command `simgap` as a user gives it."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

SIMGAP = str(Path(sys.executable).parent / "simgap")


def simgap(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run one command to its end."""
    return subprocess.run((SIMGAP, *arguments), cwd=cwd, capture_output=True, text=True, check=False, timeout=300)


class Served(NamedTuple):
    """A server that runs: its process, its first address and the folder in which it keeps what is uploaded."""

    process: subprocess.Popen[str]
    address: str
    folder: Path


def start(temporary: Path, *arguments: str, cwd: Path | None = None) -> Served:
    """Start `simgap open` with a folder of its own for temporary files, and wait until it says where it is."""
    command = (SIMGAP, "open", "--no-browser", *arguments)
    process = subprocess.Popen(
        command, cwd=cwd, env=os.environ | {"TMPDIR": str(temporary)}, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    address = process.stdout.readline().removeprefix("Open ").strip()
    return Served(process, address, temporary)


def end(served: Served, by: signal.Signals = signal.SIGINT) -> int:
    """End a server and return its exit code."""
    served.process.send_signal(by)
    code = served.process.wait(20)
    assert served.process.stdout is not None
    served.process.stdout.close()
    return code
