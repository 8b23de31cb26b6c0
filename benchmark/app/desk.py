"""What is open: records, each in a folder of its own, and their diagnoses. Two tabs share nothing but the desk."""

from __future__ import annotations

import asyncio
import secrets
import shutil
import tempfile
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path

from simgap.app.jobs import Job
from simgap.app.orders import Order, Report, Settings
from simgap.records import UnusableInput

LARGEST = 200 * 10**6  # bytes of an upload, all its files together
MOST_FILES = 2000
DEEPEST = 8
AT_ONCE = 4  # diagnoses that run side by side


@dataclass(eq=False)
class OpenRecord:
    """A record: where it lies, what it holds, what was said of it last, and its diagnoses under numbers from 1 on.

    `folder` is deleted with it; an uploaded record lies in its part `files`, one from the command line stays its own.
    """

    key: str
    folder: Path
    source: str = ""
    cwd: Path | None = None
    said: Settings | None = None
    size: int = 0
    files: int = 0
    seen: Report | None = None
    looking: Job | None = None
    diagnoses: dict[int, Job] = field(default_factory=dict)
    reading: asyncio.Lock = field(default_factory=asyncio.Lock)

    @property
    def name(self) -> str:
        """The name of the file or folder."""
        return Path(self.source).name

    async def look(self) -> Report:
        """Read once what it holds."""
        async with self.reading:
            if self.seen is None:
                self.looking = self._job(Order("look", self.source), self.folder)
                self.seen = await self.looking.run()
        return self.seen

    async def receive(self, path: str, chunks: AsyncIterator[bytes]) -> None:
        """Write an uploaded file. Raises UnusableInput for a path that leads out, and for too much of anything."""
        parts = path.split("/")
        bad = any(p in ("", ".", "..") or "\\" in p or not p.isprintable() or len(p.encode()) > 255 for p in parts)
        if bad or len(parts) > DEEPEST or self.seen is not None:
            raise UnusableInput(f"{path!r} is no name for a file of a record")
        source = f"./{parts[0]}"  # so that it is never the name of a data set that simgap knows
        if self.source not in ("", source) or self.files >= MOST_FILES:
            raise UnusableInput(f"drop files alone, or one folder, and at most {MOST_FILES} of them")
        self.source, self.cwd, self.files = source, self.folder / "files", self.files + 1
        file = self.cwd.joinpath(*parts)
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            with file.open("xb") as stream:
                async for chunk in chunks:
                    self.size += len(chunk)
                    if self.size > LARGEST:
                        raise UnusableInput(too_large(parts[0]))
                    stream.write(chunk)
        except OSError as error:
            raise UnusableInput(f"{path} cannot be stored: {error.strerror or error}") from None

    def diagnose(self, said: Settings) -> int:
        """Begin a diagnosis and return its number."""
        number = len(self.diagnoses) + 1
        out = self.folder / str(number)
        out.mkdir()
        self.said = said
        self.diagnoses[number] = self._job(Order("diagnose", self.source, said, str(out)), out)
        return number

    def _job(self, order: Order, log: Path) -> Job:
        return Job(order, self.cwd or Path.cwd(), log / "errors.txt")


def too_large(name: str) -> str:
    """Refuse an upload that is beyond the limit."""
    return (
        f"{name} has more than {LARGEST // 10**6} MB: cut the record, or give it on the command line, where there is "
        f"no limit: simgap open {name}"
    )


class Desk:
    """All open records, and the folder that holds what belongs to them."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="simgap-open-"))  # readable by its owner only
        self.records: dict[str, OpenRecord] = {}
        self.running: set[asyncio.Task[Report]] = set()

    def add(self, source: str = "", said: Settings | None = None) -> OpenRecord:
        """Open a record: that of the command line, or an empty one that files are uploaded to."""
        key = secrets.token_urlsafe(12)
        folder = self.folder / key
        folder.mkdir()
        self.records[key] = OpenRecord(key, folder, source, said=said)
        return self.records[key]

    def begin(self, record: OpenRecord, said: Settings) -> int:
        """Begin a diagnosis and return its number. Raises UnusableInput where too many run already."""
        if len(self.running) >= AT_ONCE:
            raise UnusableInput(f"{AT_ONCE} diagnoses are running: wait for one of them, or stop it")
        number = record.diagnose(said)
        task = asyncio.create_task(record.diagnoses[number].run())
        self.running.add(task)
        task.add_done_callback(self.running.discard)
        return number

    def remove(self, record: OpenRecord) -> None:
        """Stop what runs on a record and delete its folder."""
        for job in (record.looking, *record.diagnoses.values()):
            if job is not None:
                job.stop()
        self.records.pop(record.key, None)
        shutil.rmtree(record.folder, ignore_errors=True)

    async def close(self) -> None:
        """Stop everything and delete everything."""
        for record in list(self.records.values()):
            self.remove(record)
        await asyncio.gather(*self.running, return_exceptions=True)
        shutil.rmtree(self.folder, ignore_errors=True)
