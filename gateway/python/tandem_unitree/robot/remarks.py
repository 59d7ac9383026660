"""Log lines about requests that the simulator does not follow, each written once."""

from __future__ import annotations

import logging
import sys

LOG = logging.getLogger("tandem_unitree")
"""The log of this package."""


def log_to_stderr(*, verbose: bool = False) -> None:
    """Prints the log of this package."""
    logging.basicConfig(format="%(message)s", stream=sys.stderr)
    LOG.setLevel(logging.DEBUG if verbose else logging.INFO)


class Remarks:
    """The remarks about one robot, each of which is logged once."""

    def __init__(self, robot: str) -> None:
        self._robot = robot
        self.made: list[str] = []

    def once(self, text: str) -> None:
        """Logs `text` unless it was logged before."""
        if text not in self.made:
            self.made.append(text)
            LOG.warning("robot %s: %s", self._robot, text)
