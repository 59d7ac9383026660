"""File of an episode that an agent has started: its flags, its id and its operators."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, cast

from ... import __version__
from ...errors import TandemError

FILE = "agent.json"
RESULT_FILE = "result.json"

FORMATS = (1, 2)
"""Versions of this file and of the conversation files that can be read. The last one is written; every change adds
one. Version 1 has no robots' own models, and in conversations neither settings, times nor retries.
"""

_MODE = 0o600


@dataclass(frozen=True)
class EpisodeFile:
    """Contents of `agent.json` in an episode's folder. Only its owner may read it, because it has operators'
    tokens.
    """

    episode_id: str
    flags: dict[str, Any]
    """Flags of the play, defaults included."""

    server_flags: dict[str, str]
    """Flags of `tandem agent` that concern its server, as given."""

    operators: tuple[dict[str, str], ...] = ()
    """Robot and token of each operator, if each robot has its own model."""

    def write(self, folder: Path) -> None:
        """Writes the file, whole or not at all. Raises OSError."""
        content = {"format": FORMATS[-1], "tandem": __version__, **asdict(self)}
        temporary = folder / f".{FILE}-{os.getpid()}"
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, _MODE)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            json.dump(content, file, indent=1)
        temporary.replace(folder / FILE)

    @staticmethod
    def remove(folder: Path) -> None:
        """Removes the file, so that the play cannot be resumed."""
        (folder / FILE).unlink(missing_ok=True)

    @staticmethod
    def read(folder: Path) -> EpisodeFile:
        """Reads the file of an episode's folder."""
        if not folder.is_dir():
            raise TandemError(f"there is no folder {folder}; --resume takes that of an episode{_others(folder.parent)}")
        path = folder / FILE
        try:
            fields = json.loads(path.read_text(encoding="utf-8"))
            if fields["format"] not in FORMATS:
                raise TandemError(
                    f"{path} was kept by Tandem {fields['tandem']}, and this is {__version__}, which reads it otherwise; "
                    "resume the episode with that version"
                )
            kept = {name: fields[name] for name in ("episode_id", "flags", "server_flags")}
            kept["flags"] = {"robot_models": {}, **kept["flags"]}
            episode = EpisodeFile(**kept, operators=tuple(fields["operators"]))
        except FileNotFoundError:
            others = _others(folder.parent)
            raise TandemError(f"{folder} has no {FILE}: it is no folder of an agent's episode{others}") from None
        except (OSError, KeyError, TypeError, ValueError) as error:
            raise TandemError(f"{path} cannot be read ({error}); play the task anew, without --resume") from error
        if folder.resolve().name != episode.episode_id:
            raise TandemError(f"{folder} was called {episode.episode_id}, as its episode is; rename it back")
        return episode


def conversation_path(folder: Path, robot: str | None) -> Path:
    """Returns the file of a conversation: that of one robot's model, or of the model that controls all."""
    return folder / ("agent.jsonl" if robot is None else f"agent-{robot}.jsonl")


def read_result(folder: Path) -> dict[str, Any] | None:
    """Reads the result of an episode; returns None if it has not ended."""
    try:
        return cast("dict[str, Any]", json.loads((folder / RESULT_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return None


def _others(runs: Path) -> str:
    """Names the neighbouring folders in which a play can be resumed."""
    folders = sorted(str(path.parent) for path in runs.glob(f"*/{FILE}") if not (path.parent / RESULT_FILE).exists())
    return f"; have: {', '.join(folders)}" if folders else ", as runs/handover-seed0"
