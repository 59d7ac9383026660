"""The journal of one conversation."""

from __future__ import annotations

import sys

from ...errors import TandemError
from .episode_file import EpisodeFile
from .events import Begun, Event, read, written
from .line_file import LineFile


class Journal:
    """The events of a conversation, beginning with those of earlier processes.

    Args:
        lines: File for the events. None: they are not kept, and the play cannot be resumed.
    """

    def __init__(self, lines: LineFile | None = None) -> None:
        self._lines = lines
        self.earlier: list[Event] = [] if lines is None else _read(lines)
        """Events of earlier processes."""

    @property
    def begun(self) -> Begun | None:
        """First event of the conversation; None if it has not begun."""
        first = self.earlier[0] if self.earlier else None
        return first if isinstance(first, Begun) else None

    def write(self, event: Event) -> None:
        """Writes an event. If that fails, the model plays on, but the play cannot be resumed, because a
        conversation with a gap would be a different one.
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
