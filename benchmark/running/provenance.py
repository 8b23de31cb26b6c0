"""Where a result comes from: code, versions and machine."""

from __future__ import annotations

import platform
import subprocess
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any


def provenance(threads: int) -> dict[str, Any]:
    """What all results of one run have in common."""
    return {
        "commit": _commit(),
        "simgap": version("simgap"),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        "device": "cpu",
        "threads": threads,
        "platform": f"{platform.system()} {platform.machine()}",
    }


@cache
def _commit() -> str | None:
    """The commit of simgap's own checkout, with "-dirty" when files differ from it; None outside of one."""
    package = Path(__file__)
    # An installed copy may lie inside somebody else's repository, whose commit says nothing about simgap.
    tracked = ["git", "ls-files", "--error-unmatch", package.name]
    describe = ["git", "describe", "--always", "--dirty", "--exclude=*", "--abbrev=40"]
    try:
        for command in (tracked, describe):
            answer = subprocess.run(command, cwd=package.parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return answer.stdout.strip()
