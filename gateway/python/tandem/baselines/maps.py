"""The policy map with which `tandem evaluate` queries a baseline."""

from __future__ import annotations

from .settings import TrainingSettings

MAP_FILE = "map.toml"

# With a global scope one answer moves all robots, whichever networks it comes from.
GLOBAL = """preset = "openpi"
scope = "global"
answer = "all"
instruction = "joint"
"""
LOCAL = """preset = "openpi"
scope = "local"
answer = "one"
instruction = "robot"
"""
KEYS = """[images]
"image{suffix}" = {{ camera = "egocentric", size = [{width}, {height}], fit = "stretch", layout = "hwc" }}
[state]
"state{suffix}" = ["joints", "base_command"]
"moment{suffix}" = ["episode", "step", "reset"]
[prompt]
"prompt" = "text"
[action]
"actions{suffix}" = ["row"]
[chunk]
rows = {rows}
execute = {execute}
rate_hz = {rate_hz}.0
between = "interpolate"
"""


def map_text(settings: TrainingSettings, size: tuple[int, int], rate_hz: int) -> str:
    """Returns the map of a policy with these settings, image size and rate."""
    scope, suffix = (GLOBAL, "_{robot}") if settings.scope == "global" else (LOCAL, "")
    rows, execute = settings.chunk_rows, settings.execute_rows
    return scope + KEYS.format(suffix=suffix, width=size[0], height=size[1], rows=rows, execute=execute, rate_hz=rate_hz)


def key(name: str, robot: str, scope: str) -> str:
    """Returns a key of the map as sent for a robot."""
    return f"{name}_{robot}" if scope == "global" else name
