"""RPC services of a G1: `sport` (called `loco` by older programs), `arm` and `motion_switcher`.

Calls that cannot be simulated get code 3203 and one log line. Numbers of calls and their parameters as in
`g1_loco_api.py`, `g1_arm_action_api.py` and `motion_switcher_api.py` of unitree_sdk2_python.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from ..wire.rpc import BAD_PARAMETER, NOT_IMPLEMENTED, OK, Request
from .commands import FACTORY_MODE, RELEASED, Commands

Reply: TypeAlias = tuple[int, str]
"""Status code, and data as JSON."""

SERVICES = ("sport", "loco", "arm", "motion_switcher")
"""Names of the services; requests come on `rt/api/NAME/request`."""

API_VERSION = 1
"""Call that every service answers with the version of its interface."""

_VERSIONS = {"sport": "1.0.0.0", "loco": "1.0.0.0", "arm": "1.0.0.14", "motion_switcher": "1.0.0.1"}

STANDING_FSM_ID = 500
"""State of the motion controller at the beginning: it balances and walks."""

_UPRIGHT_FSM_IDS = (4, 200, 500, 501, 801)
"""States in which a G1 stands or walks, all of which are the same to the simulator."""

_FSM_IDS_THAT_STOP = (0, 1)
"""Zero torque and damping, which let a G1 collapse; the simulated robot stops walking."""

STEP_HEIGHT_M = 0.1
"""Answer to `GetSwingHeight`."""

_NO_DATA = (OK, "")
_CANNOT = (NOT_IMPLEMENTED, "")


class Services:
    """The services of one robot.

    now_s: Returns the simulated time, by which the duration of a velocity is measured.
    """

    def __init__(self, commands: Commands, now_s: Callable[[], float]) -> None:
        self._commands = commands
        self._now_s = now_s
        self._fsm_id = STANDING_FSM_ID
        handlers = {"sport": self._sport, "loco": self._sport, "arm": self._arm, "motion_switcher": self._switcher}
        self._handlers: dict[str, Callable[[int, Mapping[str, Any]], Reply]] = handlers

    def answer(self, service: str, request: Request) -> Reply:
        """Returns status code and data of the answer to a request."""
        if request.api_id == API_VERSION:
            return OK, _VERSIONS[service]
        try:
            parameter: dict[str, Any] = json.loads(request.parameter or "{}")
            code, data = self._handlers[service](request.api_id, parameter)
        except (ValueError, KeyError, TypeError, AttributeError):
            return BAD_PARAMETER, ""
        if code == NOT_IMPLEMENTED:
            call = f"{service} {request.api_id} {request.parameter or '{}'}"
            self._commands.remarks.once(f"{call} cannot be simulated and is answered with {NOT_IMPLEMENTED}")
        return code, data

    def _sport(self, api_id: int, parameter: Mapping[str, Any]) -> Reply:
        """Answers the motion controller's calls; while the mode is released there is no motion controller."""
        if self._commands.mode == RELEASED:
            return _CANNOT
        told = {7001: self._fsm_id, 7002: 0, 7003: 0, 7004: STEP_HEIGHT_M, 7005: self._commands.height_share}
        if api_id in told:
            return OK, json.dumps({"data": told[api_id]})
        if api_id == 7101:
            return self._set_fsm_id(int(parameter["data"]))
        if api_id == 7102:
            return _NO_DATA if int(parameter["data"]) == 0 else _CANNOT
        if api_id == 7104:
            self._commands.height_share = min(max(float(parameter["data"]), 0.0), 1.0)
            return _NO_DATA
        if api_id == 7105:
            vx_m_s, vy_m_s, yaw_rate_rad_s = (float(part) for part in parameter["velocity"])
            until_s = self._now_s() + float(parameter.get("duration", 1.0))
            self._commands.walk((vx_m_s, vy_m_s, yaw_rate_rad_s), until_s)
            return _NO_DATA
        return _CANNOT

    def _set_fsm_id(self, fsm_id: int) -> Reply:
        if fsm_id in _UPRIGHT_FSM_IDS:
            self._fsm_id = fsm_id
            return _NO_DATA
        if fsm_id in _FSM_IDS_THAT_STOP:
            self._commands.walk((0.0, 0.0, 0.0), self._now_s())
        return _CANNOT

    def _arm(self, api_id: int, parameter: Mapping[str, Any]) -> Reply:
        """Answers the service of gestures: there are none."""
        if api_id == 7107:
            return OK, "[]"
        return _CANNOT

    def _switcher(self, api_id: int, parameter: Mapping[str, Any]) -> Reply:
        if api_id == 1001:
            return OK, json.dumps({"form": "0", "name": self._commands.mode})
        if api_id == 1002:
            if parameter["name"] != FACTORY_MODE:
                return _CANNOT
            self._commands.select_mode(FACTORY_MODE)
            return _NO_DATA
        if api_id == 1003:
            self._commands.select_mode(RELEASED)
            return _NO_DATA
        return _CANNOT
