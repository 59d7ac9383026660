"""`python -m tandem`: the command line."""

from __future__ import annotations

from .program import command_line

if __name__ == "__main__":
    command_line()
