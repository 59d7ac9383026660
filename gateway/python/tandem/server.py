"""A server in the background of this process."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from types import TracebackType

from . import _native
from .base import Camera, Renderer, Sensors, StateEstimate, StressAxis, StressLevel, settings_json
from .contract.replies import Assistance


class Server:
    """A server in the background, with REST and MCP as in `tandem serve`. It ends with a `with` block, or by
    `stop`.
    """

    def __init__(self, native: _native.Server) -> None:
        self._native = native

    @property
    def url(self) -> str:
        """URL of the server, for example "http://127.0.0.1:8700"."""
        return self._native.url

    def stop(self) -> list[str]:
        """Finishes pending calls and closes every recording. Returns the episodes that could not be ended in time."""
        return self._native.stop()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.stop()


def serve(
    listen: str = "127.0.0.1:0",
    *,
    runs: str | PathLike[str] = "runs",
    assistance: Assistance = "full",
    renderer: Renderer = "auto",
    state_estimate: StateEstimate = "estimator",
    sensors: Sensors = "ideal",
    camera: Camera = "ideal",
    stress: StressAxis | None = None,
    level: StressLevel | None = None,
    scene: str | PathLike[str] | None = None,
    robot: str | PathLike[str] | None = None,
    task_file: str | PathLike[str] | None = None,
    max_episodes: int = 8,
    token_file: str | PathLike[str] | None = None,
) -> Server:
    """Starts to serve episodes over HTTP, and returns at once.

    Args:
        listen: Address and port; port 0 picks a free one.
        runs: Folder for recordings, one folder per episode.
        assistance: Information for policies.
        renderer: Renderer of images.
        state_estimate: Source of the robots' own state.
        sensors: Sensor model of the robots.
        camera: Model of the robots' cameras.
        stress: Disturbance; results name it.
        level: Level of the stress; 1 by default.
        scene: MJCF file of a scene in place of the tasks' own.
        robot: File with a robot in place of the embedded one.
        task_file: TOML file with your own task, in addition to the built-in ones.
        max_episodes: Maximum number of episodes held at once.
        token_file: File with the token that every request has to send. Required if other machines can reach the
            address.
    """
    settings = settings_json(
        listen=listen,
        runs=Path(runs),
        assistance=assistance,
        renderer=renderer,
        state_estimate=state_estimate,
        sensors=sensors,
        camera=camera,
        stress=stress,
        level=level,
        scene=None if scene is None else Path(scene),
        robot=None if robot is None else Path(robot),
        task_file=None if task_file is None else [str(Path(task_file))],
        max_episodes=max_episodes,
        token_file=None if token_file is None else Path(token_file),
    )
    return Server(_native.Server.start(settings))
