"""Libraries of the extra `import`, which the wheel can be used without."""

from __future__ import annotations

from importlib import import_module
from typing import Any

mujoco: Any = import_module("mujoco")
