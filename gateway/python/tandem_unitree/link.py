"""The operator of one robot, over Tandem's REST interface."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tandem import Client, EpisodeEnded, Refused
from tandem.base import ROW_COLUMNS

from .robot.commands import DRIVE_FIELDS, BaseRange
from .robot.remarks import LOG
from .robot.sensing import Moment, moment_of
from .wire.joints import JOINTS

_TOO_LATE = ("late-command", "double-command")
"""Kinds of refusal of a command that came after its step, or while another one of the same robot was waiting."""

_GONE = ("unknown-episode", "no-token", "operator-finished", "shutting-down")
"""Kinds of refusal where the server no longer holds the episode."""


@dataclass(frozen=True)
class Access:
    """Access of an operator: a server, and the token that names episode and robot."""

    url: str
    token: str


class Link:
    """One operator's connection. A link is for one thread; `again` makes another for a second thread."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._client = Client(access.url, token=access.token)
        held = self._client.request("GET", "/v1/episodes")["episodes"]
        if not held:
            raise Refused(
                "no-episode", "No episode", "the token is not an operator's, or its episode is over; start another one"
            )
        self.episode_id = str(held[0]["episode_id"])
        briefing = self._get("/briefing")
        self.robot = str(briefing["instructions"][0]["robot"])
        kind_of = {robot["robot"]: robot["kind"] for robot in briefing["robots"]}
        kind = {kind["kind"]: kind for kind in briefing["kinds"]}[kind_of[self.robot]]
        names = ("vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m")
        self.limits = BaseRange(**{name: (float(kind[name]["min"]), float(kind[name]["max"])) for name in names})
        self._step = -1

    def again(self) -> Link:
        """Returns a further link of the same operator."""
        return Link(self._access)

    def _get(self, path: str) -> Any:
        return self._client.request("GET", f"/v1/episodes/{self.episode_id}{path}")

    def _call(self, tool: str, arguments: dict[str, Any]) -> Any:
        try:
            return self._client.request("POST", f"/v1/episodes/{self.episode_id}/tools/{tool}", arguments)
        except Refused as refused:
            if refused.kind in _GONE:
                raise EpisodeEnded(refused.kind, refused.title, refused.detail) from refused
            raise

    def sense(self, before: Moment | None) -> Moment:
        """Returns the robot's present state."""
        state = self._call("get_robot_state", {"robot": self.robot, "samples": True})
        self._step = int(state["step"])
        return moment_of(state, before)

    def has_moved(self) -> bool:
        """Returns whether the episode has moved on since `sense`. Unlike `sense` it makes nobody wait for this robot."""
        held = self._client.request("GET", "/v1/episodes")["episodes"]
        if not held or held[0]["ended"] is not None:
            raise EpisodeEnded("ended", "Episode ended", "the episode has ended")
        return int(held[0]["step"]) != self._step

    def command(self, row: NDArray[np.float64]) -> bool:
        """Executes one control step with an action row. Returns `False` if it came too late for this step and was refused."""
        if row.shape != (ROW_COLUMNS,):
            raise ValueError(f"a row has {ROW_COLUMNS} numbers, not {row.shape}")
        return self._execute("send_joint_chunk", row)

    def drive(self, drives: NDArray[np.float64]) -> bool:
        """Executes one control step with setpoints of all motors, like `command`.

        drives: 5 by 43: position [rad], velocity [rad/s], kp [N m/rad], kd [N m s/rad] and torque [N m] of each joint.
        """
        if drives.shape != (len(DRIVE_FIELDS), JOINTS):
            raise ValueError(f"setpoints are {len(DRIVE_FIELDS)} by {JOINTS} numbers, not {drives.shape}")
        return self._execute("send_joint_drives", drives.ravel())

    def _execute(self, tool: str, row: NDArray[np.float64]) -> bool:
        try:
            rows = [[round(value, 6) for value in row.tolist()]]
            self._call(tool, {"robots": [{"robot": self.robot, "rows": rows}], "short": True})
        except Refused as refused:
            if refused.kind not in _TOO_LATE:
                raise
            return False
        return True

    def picture(self) -> tuple[float, NDArray[np.uint8]]:
        """Returns the simulated time and the head camera's picture: height by width by red, green, blue."""
        seen = self._call("observe", {"robots": [self.robot], "images": "rgb", "short": True})
        camera = seen["cameras"][0]
        pixels = np.frombuffer(base64.b64decode(seen["arrays"][0]["rgb"]), np.uint8)
        return float(seen["time_s"]), np.reshape(pixels, (camera["height"], camera["width"], 3))

    def pace(self) -> None:
        """Has partners' commands go on over the single steps of this robot, which a server before this version cannot."""
        try:
            self._client.request("POST", "/operate/pace")
        except Refused as refused:
            LOG.info("robot %s: commands of partners are cut to one step each (%s)", self.robot, refused.title)

    def note(self, text: str) -> None:
        """Keeps a note in the recording."""
        body = {"text": text, "kind": "note", "robot": self.robot}
        self._client.request("POST", f"/v1/episodes/{self.episode_id}/notes", body)

    def close(self) -> None:
        """Closes the connection."""
        self._client.close()
