"""Exceptions; the text of each says what would work."""

from __future__ import annotations


class TandemError(Exception):
    """An operation is not possible; the text says what would work."""


class Unreachable(TandemError):
    """A server gives no answer."""


class Refused(TandemError):
    """An episode or a server refuses a request."""

    def __init__(self, kind: str, title: str, detail: str, retry_after_s: float | None = None) -> None:
        super().__init__(detail)
        self.kind = kind
        """Stable name of the kind of refusal, for example "unknown-robot"."""

        self.title = title
        """The kind in words."""

        self.detail = detail
        """Problem of this call and what would work; it is the exception's text."""

        self.retry_after_s = retry_after_s
        """Seconds after which the same request may work. None: it will be refused again."""

    def __reduce__(self) -> tuple[type[Refused], tuple[str, str, str, float | None]]:
        return type(self), (self.kind, self.title, self.detail, self.retry_after_s)


class EpisodeEnded(Refused):
    """The episode has ended and executes no more commands."""


class SimulatorFailed(Refused):
    """The simulator failed in this episode, which has ended; its recording has everything before that."""


_CLASSES: dict[str, type[Refused]] = {
    "ended": EpisodeEnded,
    "episode-stopped": EpisodeEnded,
    "diverged": SimulatorFailed,
    "episode-failed": SimulatorFailed,
}


def of_kind(kind: str, title: str, detail: str, retry_after_s: float | None = None) -> TandemError:
    """Returns the exception for a refusal of this kind."""
    if kind == "failed":
        return TandemError(detail)
    return _CLASSES.get(kind, Refused)(kind, title, detail, retry_after_s)
