"""The journal of one conversation."""

from __future__ import annotations

import sys

from ...errors import TandemError
from .episode_file import EpisodeFile
from .events import Begun, Event, read, written
from .line_file import LineFile


class Journal:
    """The events of a conversation, those of earlier processes first.

    lines: The file that they are written to. None: they are kept nowhere, and nothing can be resumed.
    """

    def __init__(self, lines: LineFile | None = None) -> None:
        self._lines = lines
        self.earlier: list[Event] = [] if lines is None else _read(lines)
        """Events of earlier processes."""

    @property
    def begun(self) -> Begun | None:
        """How the conversation began; None: it has not."""
        first = self.earlier[0] if self.earlier else None
        return first if isinstance(first, Begun) else None

    def write(self, event: Event) -> None:
        """Writes an event down. Where that fails, the model plays on, and nobody can resume the play: a
        conversation with a gap would be another one.
        """
        if self._lines is None:
            return
        try:
            self._lines.append(written(event))
        except OSError as error:
            path = self._lines.path
            print(f"tandem agent: {path}: {error.strerror}; the play goes on, and --resume cannot take it up", file=sys.stderr)
            self._lines = None
            EpisodeFile.remove(path.parent)


def _read(lines: LineFile) -> list[Event]:
    try:
        return [read(line) for line in lines.read()]
    except (KeyError, TypeError, ValueError) as error:
        raise TandemError(f"{lines.path} holds what is no event ({error}); play the task anew, without --resume") from error
