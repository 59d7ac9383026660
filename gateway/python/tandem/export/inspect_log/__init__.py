"""Logs of Inspect (inspect-ai) from agents' episodes: `tandem export inspect`.

    from tandem.export.inspect_log import export_inspect

    export_inspect("runs", "logs")

It needs the package of `pip install 'tandem-sim[inspect]'`. `inspect view --log-dir logs` shows the logs.
"""

from __future__ import annotations

from .logs import WrittenLog, export_inspect

__all__ = ["WrittenLog", "export_inspect"]
