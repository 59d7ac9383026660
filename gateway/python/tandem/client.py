"""Episodes on a server, with the same interface as those in this process."""

from __future__ import annotations

import base64
import json
import os
import selectors
import time
import uuid
from collections.abc import Mapping, Sequence
from http.client import HTTPConnection, HTTPException, HTTPResponse, HTTPSConnection
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .base import BaseEpisode, Observation, Stepped, begun, chunk_of, integer
from .contract.arguments import Json
from .contract.replies import CameraCalibration, Protocol, RobotState
from .contract.result import ResultReply
from .contract.start import Briefing, TaskList
from .errors import TandemError, Unreachable, of_kind

_KIND = "urn:tandem:problem:"

DEFAULT_TIMEOUT_S = 720.0
"""Default timeout; it exceeds the longest call, because an operator's call waits up to 600 s for its partners."""

RESTART_S = 10.0
"""Time for which a server that has answered before may be away while it is restarted or replaced."""

_BETWEEN = (502, 503, 504)
"""Status codes of load balancers while a server is away."""


class Client:
    """Client of a server that `tandem serve` or `tandem.serve()` has started. A client is for one thread.

    Args:
        url: URL of the server, for example "http://127.0.0.1:8700".
        token: Token that the server requires. None: that of the environment variable TANDEM_TOKEN, if it is set.
        timeout_s: Time limit for an answer; operators' calls may take up to 600 s.
    """

    def __init__(self, url: str, *, token: str | None = None, timeout_s: float = DEFAULT_TIMEOUT_S) -> None:
        parts = urlsplit(url)
        try:
            port = parts.port
        except ValueError as error:
            raise TandemError(f"{url!r} is no address of a server ({error}); give one as http://127.0.0.1:8700") from error
        if parts.scheme not in ("http", "https") or parts.hostname is None:
            raise TandemError(f"{url!r} is no address of a server; give one as http://127.0.0.1:8700")
        kind = HTTPSConnection if parts.scheme == "https" else HTTPConnection
        self.url = url.rstrip("/")
        """URL of the server, without a slash at its end."""

        self._path = parts.path.rstrip("/")
        self._connection = kind(parts.hostname, port, timeout=timeout_s)
        self._elsewhere: dict[str, HTTPConnection] = {}
        self._has_answered = False
        self._token = token or os.environ.get("TANDEM_TOKEN")

    def tasks(self) -> TaskList:
        """Returns the tasks, their phases and budgets, and the robots' limits."""
        return TaskList.of(self.request("GET", "/v1/tasks"))

    def episode(self, task: str, seed: int = 0, *, protocol: Protocol = "agentic") -> RemoteEpisode:
        """Creates an episode on this server; its assistance, renderer and sensors are the server's, which records
        it.

        Args:
            task: Id of a task, for example "handover".
            seed: Seed of the objects' poses: 0 to 4294967295.
            protocol: Rules of play: "agentic" for agents that think between commands, "benchmark" for learned policies.
        """
        return RemoteEpisode(self, task, seed, protocol)

    def request(self, method: str, path: str, body: Mapping[str, Json] | None = None, *, key: str | None = None) -> Any:
        """Sends a request and returns its answer as parsed JSON; None for an empty one.

        Args:
            key: Idempotency-Key of the request, which makes the server execute it once, however often it is sent. None:
                a new key, for requests that support one.
        """
        headers = {"content-type": "application/json"}
        if self._token:
            headers["authorization"] = f"Bearer {self._token}"
        if method == "POST" and _has_keys(path):
            headers["idempotency-key"] = key or uuid.uuid4().hex
        text = None if body is None else json.dumps(body)
        try:
            response, content = self._exchange(method, self._path + path, text, headers)
        except (OSError, HTTPException) as error:
            self._connection.close()
            raise Unreachable(f"{self.url} gives no answer: {error or type(error).__name__}") from error
        status, retry = response.status, response.getheader("retry-after")
        if status == 204:
            return None
        try:
            answer = json.loads(content)
        except ValueError as error:
            raise Unreachable(f"{self.url} is no server of Tandem: it answers {status} without JSON") from error
        if status < 400:
            return answer
        kind = str(answer.get("type", "")).removeprefix(_KIND)
        detail = str(answer.get("detail", content.decode(errors="replace")))
        raise of_kind(kind, str(answer.get("title", status)), detail, float(retry) if retry else None)

    def _exchange(self, method: str, path: str, text: str | None, headers: dict[str, str]) -> tuple[HTTPResponse, bytes]:
        """Sends a request over the kept connection, or over a new one if that is gone, and reads the answer.

        A server that has answered before may be away for a while. Then only a request that is executed once is sent
        again.
        """
        may_repeat = method == "GET" or "idempotency-key" in headers
        deadline_s = time.monotonic() + (RESTART_S if self._has_answered and may_repeat else 0.0)
        pause_s = 0.0
        self._is_kept()
        while True:
            is_last = time.monotonic() >= deadline_s
            try:
                response, content = self._follow(method, path, text, headers)
                if is_last or response.status not in _BETWEEN or b"urn:tandem" in content:
                    self._has_answered = True
                    return response, content
            except TimeoutError:
                raise
            except (OSError, HTTPException):
                self.close()
                if is_last:
                    raise
            time.sleep(pause_s)
            pause_s = min(2 * pause_s + 0.05, 1.0)

    def _follow(self, method: str, path: str, text: str | None, headers: dict[str, str]) -> tuple[HTTPResponse, bytes]:
        """Sends a request, and follows a redirect to the server that plays the episode."""
        response, content = self._send(self._connection, method, path, text, headers)
        location = urlsplit(response.getheader("location") or "")
        if response.status != 307 or location.hostname is None:
            return response, content
        connection = self._elsewhere.get(location.netloc)
        if connection is None:
            kind = HTTPSConnection if location.scheme == "https" else HTTPConnection
            connection = kind(location.hostname, location.port, timeout=self._connection.timeout)
            self._elsewhere[location.netloc] = connection
        path = f"{location.path}?{location.query}" if location.query else location.path
        return self._send(connection, method, path, text, headers)

    @staticmethod
    def _send(
        connection: HTTPConnection, method: str, path: str, text: str | None, headers: dict[str, str]
    ) -> tuple[HTTPResponse, bytes]:
        connection.request(method, path, text, headers)
        response = connection.getresponse()
        return response, response.read()

    def _is_kept(self) -> bool:
        """Returns true if the connection is still open. A server may have closed it while a model was thinking or
        because of a restart; the end of the stream is then readable.
        """
        sock = self._connection.sock
        if sock is None:
            return False
        try:
            with selectors.DefaultSelector() as selector:
                selector.register(sock, selectors.EVENT_READ)
                has_ended = bool(selector.select(0))
        except (OSError, ValueError):
            has_ended = True
        if has_ended:
            self._connection.close()
        return not has_ended

    def close(self) -> None:
        """Closes the connections; the next request opens another one."""
        for connection in (self._connection, *self._elsewhere.values()):
            connection.close()


class RemoteEpisode(BaseEpisode):
    """One episode on a server."""

    def __init__(self, client: Client, task: str, seed: int, protocol: Protocol) -> None:
        self.task = task
        self.seed = integer(seed, "the seed")
        self.protocol = protocol
        self._client = client
        self._id: str | None = None
        self._result: ResultReply | None = None

    def start(self) -> Briefing:
        if self._id is not None:
            self.close()
        body = {"task": self.task, "seed": self.seed, "protocol": self.protocol}
        answer = self._client.request("POST", "/v1/episodes", body)
        self._id = str(answer["episode_id"])
        self._briefing = Briefing.of(answer)
        self._result = None
        return self._briefing

    @property
    def episode_id(self) -> str:
        """Id of the episode on the server, which is also the name of its recording's folder."""
        return begun(self._id)

    def call(self, tool: str, arguments: Mapping[str, Json]) -> Any:
        return self._client.request("POST", f"/v1/episodes/{self.episode_id}/tools/{tool}", arguments)

    def observe(self, robots: Sequence[str] | None = None, *, short: bool | None = None, depth: bool = False) -> Observation:
        arguments: dict[str, Json] = {
            "robots": None if robots is None else list(robots),
            "short": short,
            "images": "rgb",
            "depth": "float16" if depth else None,
        }
        seen = self.call("observe", {name: given for name, given in arguments.items() if given is not None})
        cameras = {camera["robot"]: CameraCalibration.of(camera) for camera in seen["cameras"]}
        rgb: dict[str, NDArray[np.uint8]] = {}
        depth_m: dict[str, NDArray[np.float32]] = {}
        for array in seen["arrays"]:
            camera = cameras[array["robot"]]
            shape = (camera.height, camera.width)
            rgb[camera.robot] = np.reshape(np.frombuffer(base64.b64decode(array["rgb"]), np.uint8), (*shape, 3))
            if depth:
                halves = np.frombuffer(base64.b64decode(array["depth_float16"]), "<f2")
                depth_m[camera.robot] = np.reshape(halves.astype(np.float32), shape)
        states = tuple(RobotState.of(state) for state in seen["states"])
        return Observation(seen["time_s"], states, tuple(cameras.values()), rgb, depth_m)

    @property
    def state_columns(self) -> tuple[str, ...]:
        return tuple(_row_of(self.get_robot_state(self.robots[0])))

    def state(self) -> NDArray[np.float32]:
        rows = [list(_row_of(self.get_robot_state(robot)).values()) for robot in self.robots]
        return np.array(rows, dtype=np.float32)

    def step(self, rows: ArrayLike) -> Stepped:
        chunk = chunk_of(rows, len(self.robots)).tolist()
        named = [{"robot": robot, "rows": own} for robot, own in zip(self.robots, chunk, strict=True)]
        reply = self.call("send_joint_chunk", {"robots": named})
        return Stepped(
            executed_steps=reply["executed_steps"],
            stop_reason=reply["stop_reason"],
            time_s=reply["time_s"],
            phases=tuple(phase["number"] for phase in reply["phases"]),
            fallen=tuple(robot["fallen"] for robot in reply.get("fallen", ())),
            ended=reply["stop_reason"] in ("task_complete", "step_budget_exhausted"),
        )

    def close(self) -> ResultReply:
        if self._result is None:
            self._result = ResultReply.of(self._client.request("DELETE", f"/v1/episodes/{self.episode_id}"))
        return self._result


def _has_keys(path: str) -> bool:
    """Returns true if requests to a path may have a key with which the server executes them once."""
    return path == "/v1/episodes" or "/tools/" in path or path.endswith("/notes")


def _row_of(state: RobotState) -> dict[str, float]:
    """Returns the values of a state by the names that an episode in this process uses."""
    row = {f"{joint}_rad": angle for joint, angle in (state.joint_positions_rad or {}).items()}
    row |= {f"{joint}_rad_s": rate for joint, rate in (state.joint_velocities_rad_s or {}).items()}
    row |= {f"{joint}_n_m": torque for joint, torque in (state.joint_torques_n_m or {}).items()}
    poses = {"left_wrist": state.left_wrist, "right_wrist": state.right_wrist}
    for name, pose in poses.items():
        row |= _pose(name, pose.position_m, pose.quaternion_wxyz)
    if state.gravity_in_pelvis is not None:
        row |= {f"gravity_{axis}": part for axis, part in zip("xyz", state.gravity_in_pelvis, strict=True)}
    if state.pelvis_in_start is not None:
        row |= _pose("pelvis_in_start", state.pelvis_in_start.position_m, state.pelvis_in_start.quaternion_wxyz)
    if (base := state.base_command) is not None:
        row |= {"vx_m_s": base.vx_m_s, "vy_m_s": base.vy_m_s}
        row |= {"yaw_rate_rad_s": base.yaw_rate_rad_s, "pelvis_height_m": base.pelvis_height_m}
    if state.fallen is not None:
        row["fallen"] = float(state.fallen)
    return row


def _pose(name: str, position_m: Sequence[float], quaternion_wxyz: Sequence[float]) -> dict[str, float]:
    parts = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
    return {f"{name}_{part}": value for part, value in zip(parts, (*position_m, *quaternion_wxyz), strict=True)}
