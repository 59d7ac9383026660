"""Runs `python -m tandem_unitree`."""

from __future__ import annotations

import sys

from .command_line import command_line

if __name__ == "__main__":
    sys.exit(command_line())
