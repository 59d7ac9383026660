"""A file of JSON lines with a single writer; after SIGKILL its lines are still whole."""

from __future__ import annotations

import fcntl
import json
import os
from errno import EAGAIN, EWOULDBLOCK
from pathlib import Path
from typing import Any

from ...errors import TandemError

_MODE = 0o600


class LineFile:
    """The file, which is created if necessary and locked until this process ends."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC, _MODE)
        except OSError as error:
            raise TandemError(f"{path}: {error.strerror}; make it readable and writable") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            # Some network file systems have no locks.
            if error.errno in (EAGAIN, EWOULDBLOCK):
                os.close(self._file)
                raise TandemError(f"{path} is another process's{_of(path)}; wait until that has ended, or end it") from None

    def read(self) -> list[Any]:
        """Returns the whole lines. An incomplete line of a killed process is cut off."""
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        os.ftruncate(self._file, whole)
        try:
            return [json.loads(line) for line in content[:whole].splitlines()]
        except ValueError as error:
            raise TandemError(f"{self.path} holds what is no JSON ({error}); play the task anew, without --resume") from error

    def append(self, value: Any) -> None:
        """Writes a line, which the operating system then has. Raises OSError."""
        left = memoryview(f"{json.dumps(value, separators=(',', ':'))}\n".encode())
        while left:
            left = left[os.write(self._file, left) :]

    def close(self) -> None:
        """Closes the file and releases its lock."""
        os.close(self._file)


def _of(path: Path) -> str:
    """Names the process that wrote a file last, if its lines include it."""
    pids = [pid for line in path.read_bytes().splitlines() if (pid := _pid(line)) is not None]
    return f" ({pids[-1]})" if pids else ""


def _pid(line: bytes) -> int | None:
    try:
        return json.loads(line).get("pid")
    except (ValueError, AttributeError):
        return None
