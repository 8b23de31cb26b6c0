"""A worker process under way: it is followed line by line, and can be stopped."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from simgap.app.orders import Order, Report

LONGEST_LINE = 2**26  # bytes; a look holds the curves of a record
COMMAND = (sys.executable, "-P", "-m", "simgap.app.worker")  # -P: nothing beside a record is imported
STOPPED = "Stopped before it had an answer."


@dataclass(eq=False)
class Job:
    """One order in a process of its own. `ended` is its last report; its standard error goes into a file of `log`."""

    order: Order
    folder: Path
    log: Path
    ended: Report | None = None
    stages: list[tuple[float, str]] = field(default_factory=list)  # s since the start
    began: float = field(default_factory=time.monotonic)
    process: asyncio.subprocess.Process | None = None

    async def run(self) -> Report:
        """Carry out the order in `folder` and give its last report; whatever goes wrong there is a refusal."""
        try:
            last = await self._run()
        except OSError as error:  # no memory for a process, or its folder was deleted
            last = Report(refused=f"It could not be started: {error}")
        self.ended = self.ended or last
        return self.ended

    async def _run(self) -> Report:
        with self.log.open("wb") as errors:
            self.process = await asyncio.create_subprocess_exec(
                *COMMAND, cwd=self.folder, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                stderr=errors, limit=LONGEST_LINE, start_new_session=True,
            )  # fmt: skip
        if self.ended is not None:  # it was stopped while the process began
            self._kill()
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(msgspec.json.encode(self.order))
        self.process.stdin.close()
        last = Report()
        async for line in self.process.stdout:
            with suppress(msgspec.MsgspecError):  # it was killed while it wrote the line; its exit code says so
                last = msgspec.json.decode(line, type=Report)
            if last.stage:
                self.stages.append((self.seconds, last.stage))
        code = await self.process.wait()
        return last if code == 0 else Report(refused=self._why(code))

    def stop(self) -> None:
        """Kill the process and those that it has begun."""
        if self.ended is None:
            self.ended = Report(refused=STOPPED)
            self._kill()

    @property
    def seconds(self) -> float:
        """Time since it began, in s."""
        return time.monotonic() - self.began

    def _kill(self) -> None:
        if self.process is not None and self.process.returncode is None:
            with suppress(ProcessLookupError):  # it has just ended
                os.killpg(self.process.pid, signal.SIGKILL)

    def _why(self, code: int) -> str:
        if code < 0:
            return f"It was ended by signal {-code}; for want of memory, as a rule."
        lines = self.log.read_text(encoding="utf-8", errors="replace").split("\n")
        said = next((line for line in reversed(lines) if line.strip()), f"exit code {code}")
        return f"It broke off, which is a fault of simgap: {said.strip()[:300]}"
