"""Journal of an agent's play, from which an interrupted play can be resumed."""

from __future__ import annotations

from .episode_file import EpisodeFile, conversation_path, read_result
from .events import Answered, Begun, Ended, Event, Halved, Noted, Replied, Resumed, now
from .journal import Journal
from .line_file import LineFile
from .progress import Progress

__all__ = [
    "Answered",
    "Begun",
    "Ended",
    "EpisodeFile",
    "Event",
    "Halved",
    "Journal",
    "LineFile",
    "Noted",
    "Progress",
    "Replied",
    "Resumed",
    "conversation_path",
    "now",
    "read_result",
]
