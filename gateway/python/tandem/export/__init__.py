"""Data sets for training policies, made from recordings: `tandem export`.

    from tandem.export import ExportSettings, export_lerobot

    export_lerobot("runs/demonstrations", "data/handover", ExportSettings(rate_hz=10))

It needs the packages of `pip install 'tandem-sim[lerobot]'`: pyarrow, and PyAV with its encoders.
"""

from __future__ import annotations

from .lerobot import Exported, export_lerobot
from .settings import ExportSettings

__all__ = ["ExportSettings", "Exported", "export_lerobot"]
