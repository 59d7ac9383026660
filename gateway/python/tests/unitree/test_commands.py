"""Commands, services and the clock of one robot."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from tandem_unitree.robot.clock import Clock, OwnLastMessage, PictureTurns
from tandem_unitree.robot.commands import FACTORY_MODE, RELEASED, BaseRange, Commands
from tandem_unitree.robot.remarks import Remarks
from tandem_unitree.robot.services import Services
from tandem_unitree.wire.layout import HAND_COMMAND, LOW_COMMAND, Record, blank, command_crc, serialized
from tandem_unitree.wire.rpc import BAD_PARAMETER, NOT_IMPLEMENTED, OK, Request

WAIST_YAW_COLUMN, WAIST_ROLL_COLUMN, LEFT_ELBOW_COLUMN = 28, 29, 3
WAIST_YAW, WAIST_ROLL, LEFT_ELBOW, LEFT_KNEE, WEIGHT = 12, 13, 18, 3, 29


def commands(*, released: bool = False, joint_control: bool = False) -> Commands:
    """A robot whose joints rest at 0.1 rad."""
    return Commands(np.full(35, 0.1), BaseRange(), Remarks("A"), released=released, joint_control=joint_control)


def low(targets: dict[int, float], *, weight: float = 1.0, mode: int = 1, **fields: int) -> Record:
    """A command with stiffness for the motors that have targets."""
    record = blank(LOW_COMMAND)
    record["mode_machine"] = 5
    for name, value in fields.items():
        record[name] = value
    for motor, target in targets.items():
        record["motors"]["q"][motor], record["motors"]["kp"][motor] = target, 60.0
    record["first_mode"], record["motors"]["next_mode"][:-1] = mode, mode
    record["motors"]["q"][WEIGHT] = weight
    record["crc"] = command_crc(record)
    return record


def request(api_id: int, **parameter: Any) -> Request:
    return Request(1, api_id, json.dumps(parameter))


def services(robot: Commands, now_s: float = 10.0) -> Services:
    return Services(robot, lambda: now_s)


def test_arm_sdk_moves_by_its_weight() -> None:
    robot = commands()
    for weight, expected in ((0.0, 0.1), (0.5, 0.3), (1.0, 0.5), (7.0, 0.5), (-1.0, 0.1)):
        assert robot.arm_command(serialized(low({WAIST_YAW: 0.5}, weight=weight, mode=0)))
        assert np.isclose(robot.row(0.0)[WAIST_YAW_COLUMN], expected)
    assert np.isclose(robot.row(0.0)[LEFT_ELBOW_COLUMN], 0.1), "no stiffness, no command"


def test_a_wrong_checksum_is_dropped() -> None:
    robot = commands()
    record = low({WAIST_YAW: 0.5})
    record["crc"] += 1
    assert not robot.arm_command(serialized(record))
    assert not robot.arm_command(b"")
    assert robot.bad_crcs == 2 and robot.row(0.0)[WAIST_YAW_COLUMN] == 0.1
    [remark] = robot.remarks.made
    assert "checksum" in remark


def test_lowcmd_waits_for_the_release_and_arm_sdk_for_the_factory_mode() -> None:
    robot = commands()
    robot.low_command(serialized(low({WAIST_YAW: 0.5})))
    assert robot.row(0.0)[WAIST_YAW_COLUMN] == 0.1
    robot.select_mode(RELEASED)
    robot.arm_command(serialized(low({WAIST_YAW: 0.9})))
    assert robot.row(0.0)[WAIST_YAW_COLUMN] == 0.1
    robot.low_command(serialized(low({WAIST_YAW: 0.5})))
    assert np.isclose(robot.row(0.0)[WAIST_YAW_COLUMN], 0.5)
    robot.select_mode(FACTORY_MODE)
    assert np.isclose(robot.row(0.0)[WAIST_YAW_COLUMN], 0.5), "the pose stays"


def test_a_disabled_motor_of_lowcmd_keeps_its_pose() -> None:
    robot = commands(released=True)
    robot.low_record(low({WAIST_YAW: 0.5}, mode=0))
    assert robot.row(0.0)[WAIST_YAW_COLUMN] == 0.1


def test_joint_control_drives_every_motor_with_its_gains() -> None:
    robot = commands(joint_control=True)
    assert robot.drives() is None, "the mode is not released"
    robot.select_mode(RELEASED)
    assert robot.drives() is None, "no command has come"
    record = low({LEFT_KNEE: 0.5, LEFT_ELBOW: -0.2})
    record["motors"]["kd"][LEFT_KNEE], record["motors"]["tau"][LEFT_KNEE] = 2.0, -3.0
    robot.low_record(record)
    drives = robot.drives()
    assert drives is not None and drives.shape == (5, 43)
    # Joints of the right arm and of the hands come after the left arm in Tandem's order.
    assert drives[:, LEFT_KNEE].tolist() == [0.5, 0.0, 60.0, 2.0, -3.0]
    assert np.allclose(drives[:, 18], [-0.2, 0.0, 60.0, 0.0, 0.0])
    assert np.allclose(drives[:, 22], [0.1, 0.0, 2.0, 0.06, 0.0]), "an idle finger keeps its pose"
    assert not robot.remarks.made, "nothing is ignored"
    robot.low_record(low({LEFT_KNEE: 0.5}, mode=0))
    disabled = robot.drives()
    assert disabled is not None and not disabled[:, LEFT_KNEE].any(), "a disabled motor is limp"
    hand = blank(HAND_COMMAND)
    hand["count"] = 7
    hand["motors"]["q"][3:5], hand["motors"]["kp"][3:5], hand["motors"]["tau"][3:5] = 0.6, 1.5, 0.2
    assert robot.hand_command("right", serialized(hand))
    fingers = robot.drives()
    assert fingers is not None and np.allclose(fingers[[0, 2, 4]][:, 41:43], [[0.6] * 2, [1.5] * 2, [0.2] * 2])
    robot.select_mode(FACTORY_MODE)
    assert robot.drives() is None


def test_parallel_rods_cannot_be_driven() -> None:
    robot = commands(released=True, joint_control=True)
    robot.low_record(low({LEFT_KNEE: 0.5}, mode_pr=1))
    assert robot.drives() is None and any("mode_pr 1" in remark for remark in robot.remarks.made)


def test_what_is_ignored_is_said_once() -> None:
    robot = commands(released=True)
    for _ in range(3):
        robot.low_record(low({LEFT_KNEE: 0.5, WAIST_YAW: 0.5}, mode_machine=4))
        robot.row(0.0)
    said = "\n".join(robot.remarks.made)
    assert len(robot.remarks.made) == 3
    assert "legs" in said and "kp, kd" in said and "mode_machine 5" in said


def test_parallel_joints_are_ignored() -> None:
    robot = commands(released=True)
    robot.low_record(low({WAIST_YAW: 0.5, WAIST_ROLL: 0.2}, mode_pr=1))
    row = robot.row(0.0)
    assert np.isclose(row[WAIST_YAW_COLUMN], 0.5) and row[WAIST_ROLL_COLUMN] == 0.1
    assert any("mode_pr 1" in remark for remark in robot.remarks.made)


def test_no_number_is_no_target() -> None:
    robot = commands(released=True)
    robot.low_record(low({WAIST_YAW: np.nan, LEFT_ELBOW: np.inf}))
    assert np.isfinite(robot.row(0.0)).all()


def test_the_right_hand_has_its_index_finger_first() -> None:
    robot = commands()
    record = blank(HAND_COMMAND)
    record["count"] = 7
    record["motors"]["q"][3:5], record["motors"]["kp"][3:5] = 0.6, 1.5
    assert robot.hand_command("right", serialized(record))
    # Columns of a hand: thumb 0 1 2, middle 0 1, index 0 1.
    assert np.allclose(robot.row(0.0)[21:28], [0.1] * 5 + [0.6] * 2)
    assert robot.hand_command("left", serialized(record))
    assert np.allclose(robot.row(0.0)[14:21], [0.1] * 3 + [0.6] * 2 + [0.1] * 2)
    record["count"] = 6
    assert not robot.hand_command("left", serialized(record))


def test_a_velocity_is_limited_and_ends() -> None:
    robot = commands()
    assert services(robot).answer("sport", request(7105, velocity=[9.0, -0.1, 0.2], duration=2.0)) == (OK, "")
    assert np.allclose(robot.row(11.9)[31:34], [0.4, -0.1, 0.2]) and robot.walks(11.9)
    assert np.allclose(robot.row(12.0)[31:34], 0) and not robot.walks(12.0)
    assert any("velocities are limited" in remark for remark in robot.remarks.made)


def test_heights_run_from_the_low_stand_to_the_high_stand() -> None:
    robot = commands()
    service = services(robot)
    for data, height_m in ((0, 0.5), (2**32 - 1, 0.76), (0.5, 0.63)):
        assert service.answer("sport", request(7104, data=data)) == (OK, "")
        assert np.isclose(robot.row(0.0)[34], height_m)
    assert service.answer("loco", request(7005)) == (OK, '{"data": 0.5}')


@pytest.mark.parametrize(
    ("service", "api_id", "parameter", "code"),
    [
        ("sport", 7001, {}, OK),
        ("sport", 7002, {}, OK),
        ("sport", 7003, {}, OK),
        ("sport", 7004, {}, OK),
        ("sport", 7006, {}, NOT_IMPLEMENTED),
        ("sport", 7101, {"data": 500}, OK),
        ("sport", 7101, {"data": 0}, NOT_IMPLEMENTED),
        ("sport", 7101, {"data": 706}, NOT_IMPLEMENTED),
        ("sport", 7101, {}, BAD_PARAMETER),
        ("sport", 7102, {"data": 0}, OK),
        ("sport", 7102, {"data": 1}, NOT_IMPLEMENTED),
        ("sport", 7103, {"data": 0.1}, NOT_IMPLEMENTED),
        ("sport", 7105, {"velocity": [1]}, BAD_PARAMETER),
        ("sport", 7106, {"data": 0}, NOT_IMPLEMENTED),
        ("sport", 7107, {"data": 1}, NOT_IMPLEMENTED),
        ("arm", 7106, {"data": 27}, NOT_IMPLEMENTED),
        ("arm", 7107, {}, OK),
        ("motion_switcher", 1001, {}, OK),
        ("motion_switcher", 1002, {"name": "ai"}, OK),
        ("motion_switcher", 1002, {"name": "advanced"}, NOT_IMPLEMENTED),
        ("motion_switcher", 1003, {}, OK),
        ("motion_switcher", 1004, {"silent": True}, NOT_IMPLEMENTED),
    ],
)
def test_every_call_is_answered(service: str, api_id: int, parameter: dict[str, Any], code: int) -> None:
    robot = commands()
    assert services(robot).answer(service, request(api_id, **parameter))[0] == code
    assert bool(robot.remarks.made) == (code == NOT_IMPLEMENTED)


def test_damping_stops_a_walk() -> None:
    robot = commands()
    service = services(robot)
    service.answer("sport", request(7105, velocity=[0.2, 0, 0], duration=100))
    assert service.answer("sport", request(7101, data=1))[0] == NOT_IMPLEMENTED
    assert not robot.walks(10.0)


def test_a_program_waits_until_the_mode_is_released() -> None:
    service = services(commands())
    assert service.answer("motion_switcher", request(1001)) == (OK, '{"form": "0", "name": "ai"}')
    service.answer("motion_switcher", request(1003))
    assert service.answer("motion_switcher", request(1001)) == (OK, '{"form": "0", "name": ""}')
    assert service.answer("sport", request(7105, velocity=[0, 0, 0]))[0] == NOT_IMPLEMENTED
    assert service.answer("sport", Request(1, 1, ""))[0] == OK, "versions are told"
    assert service.answer("sport", Request(1, 7105, "{"))[0] == BAD_PARAMETER
    assert service.answer("sport", Request(1, 7105, "[1]"))[0] == NOT_IMPLEMENTED


class Hands:
    """Time of a clock that the test sets."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_the_clock_holds_after_half_a_second() -> None:
    hands = Hands()
    hold, real = Clock("hold", None, hands), Clock("real", None, hands)
    assert not hold.passes(walks=False) and real.passes(walks=False)
    hold.heard()
    hands.now_s += 0.4
    assert hold.passes(walks=False)
    hands.now_s += 0.2
    assert not hold.passes(walks=False) and hold.passes(walks=True), "a velocity is in force"


def test_robots_of_an_episode_hold_together() -> None:
    hands, shared = Hands(), OwnLastMessage()
    first, second = Clock("hold", shared, hands), Clock("hold", shared, hands)
    first.heard()
    assert second.passes(walks=False)
    hands.now_s += 1.0
    assert not second.passes(walks=False)
    assert first.passes(walks=True) and second.passes(walks=False), "one of them walks"


def test_steps_are_due_at_multiples_of_20_ms_and_never_made_up_for() -> None:
    hands = Hands()
    clock = Clock("real", None, hands)
    hands.now_s = 100.001
    assert np.isclose(clock.wait_s(), 0.019)
    hands.now_s = 100.025
    assert np.isclose(clock.wait_s(), 0.015)
    hands.now_s = 100.305
    assert clock.wait_s() == 0.0, "late: at once"
    hands.now_s = 100.309
    assert np.isclose(clock.wait_s(), 0.011)


@pytest.mark.parametrize(("period_s", "is_early"), [(0.020, True), (0.025, False)])
def test_a_robot_that_waits_for_its_partner_goes_back_into_step(period_s: float, is_early: bool) -> None:
    hands = Hands()
    clock = Clock("real", None, hands)
    waits_s: list[float] = []
    for _ in range(12):
        hands.now_s += period_s
        waits_s.append(clock.wait_s())
        if waits_s[-1] > 0:
            break
        # Its command is executed when the partner has commanded.
    assert (waits_s[-1] > 0) == is_early


def test_robots_take_turns_to_fetch_pictures() -> None:
    turns = [PictureTurns(number, 15.0) for number in range(3)]
    for robot in turns:
        robot.is_due(9.99)
    due = [[robot.is_due(10.0 + 0.02 * step + 0.01) for robot in turns] for step in range(6)]
    assert all(sum(step) == 1 for step in due) and all(sum(robot) == 2 for robot in zip(*due, strict=True))
