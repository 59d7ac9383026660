"""The whole program `tandem` inside Python."""

from __future__ import annotations

import os
import signal
import sys
import threading

from . import _native


def main(arguments: list[str] | None = None) -> int:
    """Runs a command as the program `tandem` does, and returns its exit code.

    Args:
        arguments: Arguments after the program's name, for example ["demo", "--seeds", "3"]. None: those of this
            process.
    """
    given = sys.argv[1:] if arguments is None else arguments
    if threading.current_thread() is threading.main_thread():
        # Python would only record the signal and handle it after the command.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # Language models are played by this interpreter, which has the package.
    os.environ.setdefault("TANDEM_PYTHON", sys.executable)
    sys.stdout.flush()
    return _native.run_command_line(["tandem", *given])


def command_line() -> None:
    """Entry point of the script `tandem`."""
    sys.exit(main())
