"""Files of JSON lines to which several processes append, and which a crash cannot spoil."""

from __future__ import annotations

import errno
import json
import os
import tempfile
from io import FileIO
from pathlib import Path

from simgap.records import UnusableInput

# Bytes of a file of lines.
LARGEST_FILE = 1 << 30


def append(path: Path, lines: bytes, lock: Path) -> None:
    """Write whole lines with one write, under a lock that other processes respect. Raises OSError on a full disk."""
    from filelock import FileLock

    path.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(lock), path.open("r+b" if path.exists() else "w+b", buffering=0) as file:
        size = _mend(file)
        try:
            file.seek(size)
            if file.write(lines) != len(lines):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
            os.fsync(file.fileno())
        except OSError as error:  # a full disk takes a part of them
            file.truncate(size)
            raise OSError(error.errno, error.strerror, str(path)) from error


def read(path: Path) -> list[bytes]:
    """All lines; an unfinished last one, which an interrupted write leaves, only if it is whole JSON.

    Raises UnusableInput for a file that is larger than any of this kind.
    """
    if path.stat().st_size > LARGEST_FILE:
        raise UnusableInput(f"{path} is larger than any file of results")
    *lines, last = path.read_bytes().split(b"\n")
    return [*lines, last] if last and is_json(last) else lines


def replace(path: Path, lines: bytes) -> None:
    """Write the file anew, all or nothing; the caller holds the lock."""
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}", delete=False) as file:
        file.write(lines)
        file.flush()
        os.fsync(file.fileno())
    Path(file.name).replace(path)


def is_json(line: bytes) -> bool:
    """Whether a line is a whole JSON value."""
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def _mend(file: FileIO) -> int:
    """End an unfinished last line if it is a whole result, else cut it off; the size that the file then has."""
    size = file.seek(0, os.SEEK_END)
    if size:
        file.seek(size - 1)
    if file.read(1) in (b"", b"\n"):
        return size
    file.seek(0)
    last = file.readall().rpartition(b"\n")[2]
    if is_json(last):
        return size + file.write(b"\n")
    return file.truncate(size - len(last))
