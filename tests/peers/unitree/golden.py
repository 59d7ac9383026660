"""Writes messages, serialized by Unitree's own types, for the tests of the wheel, which need neither DDS nor the SDK.

    python tests/peers/unitree/golden.py > gateway/python/tests/unitree/golden.json

A joint's values follow from its name, so the test fills the same message from Tandem's order of joints.
"""

import base64
import json
import math
import zlib

from unitree_sdk2py.idl import default
from unitree_sdk2py.idl.unitree_api.msg import dds_ as api
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import HandCmd_, MotorCmd_
from unitree_sdk2py.utils.crc import CRC

LEG = ["hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"]
ARM = ["shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw"]
BODY = [
    *(f"{side}_{joint}_joint" for side in ("left", "right") for joint in LEG),
    *(f"waist_{axis}_joint" for axis in ("yaw", "roll", "pitch")),
    *(f"{side}_{joint}_joint" for side in ("left", "right") for joint in ARM),
]
THUMB, MIDDLE, INDEX = ["thumb_0", "thumb_1", "thumb_2"], ["middle_0", "middle_1"], ["index_0", "index_1"]
HANDS = {"left": THUMB + MIDDLE + INDEX, "right": THUMB + INDEX + MIDDLE}
YAW_RAD = 0.4
crc = CRC()


def value(name):
    return 0.001 * (zlib.crc32(name.encode()) % 1000)


def fill_motor(motor, name):
    motor.mode, motor.q, motor.dq, motor.ddq, motor.tau_est = 1, value(name), value(name) + 1, value(name) + 2, value(name) + 3
    motor.temperature, motor.vol = [35, 40], 54.0


def fill_imu(imu):
    imu.quaternion = [math.cos(YAW_RAD / 2), 0.0, 0.0, math.sin(YAW_RAD / 2)]
    imu.gyroscope, imu.accelerometer, imu.rpy, imu.temperature = [0.1, 0.2, 0.3], [0.0, 0.0, 9.81], [0.0, 0.0, YAW_RAD], 40


def low_state():
    state = default.unitree_hg_msg_dds__LowState_()
    state.mode_machine, state.tick = 5, 12340
    fill_imu(state.imu_state)
    for motor, name in zip(state.motor_state, BODY, strict=False):
        fill_motor(motor, name)
    state.crc = crc.Crc(state)
    return state


def hand_state(side):
    state = default.unitree_hg_msg_dds__HandState_()
    for motor, finger in zip(state.motor_state, HANDS[side], strict=True):
        fill_motor(motor, f"{side}_hand_{finger}_joint")
    state.imu_state.quaternion, state.imu_state.temperature = [1.0, 0.0, 0.0, 0.0], 40
    # A Dex3-1 has 9 sensors, the SDK's default message 7.
    state.press_sensor_state = [default.unitree_hg_msg_dds__PressSensorState_() for _ in range(9)]
    state.power_v = state.system_v = state.device_v = 24.0
    return state


def low_command():
    command = default.unitree_hg_msg_dds__LowCmd_()
    command.mode_pr, command.mode_machine = 0, 5
    for index, motor in enumerate(command.motor_cmd):
        motor.mode, motor.q, motor.dq, motor.tau, motor.kp, motor.kd = index % 2, 0.01 * index, 1.0, 2.0, 3.0 + index, 4.0
    command.crc = crc.Crc(command)
    return command


def hand_command():
    motors = [MotorCmd_(index | 1 << 4, 0.1 * index, 0.0, 0.0, 1.5, 0.2, 0) for index in range(7)]
    return HandCmd_(motors, [0, 0, 0, 0])


def battery():
    state = default.unitree_hg_msg_dds__BmsState_()
    state.soc = state.soh = 100
    state.bmsvoltage, state.temperature = [54000] * 3, [35] * 12
    return state


def odometry():
    state = default.unitree_go_msg_dds__SportModeState_()
    state.stamp.sec, state.stamp.nanosec = 12, 340000000
    fill_imu(state.imu_state)
    state.position, state.body_height, state.velocity, state.yaw_speed = [1.0, 2.0, 0.75], 0.75, [0.1, 0.2, 0.0], 0.3
    return state


def request():
    header = api.RequestHeader_(api.RequestIdentity_(2**40 + 7, 7105), api.RequestLease_(3), api.RequestPolicy_(2, True))
    return api.Request_(header, '{"velocity": [0.1, 0, 0]}', [])


def response():
    header = api.ResponseHeader_(api.RequestIdentity_(2**40 + 7, 7105), api.ResponseStatus_(3203))
    return api.Response_(header, '{"data": 1}', [])


def imu():
    state = default.unitree_hg_msg_dds__IMUState_()
    fill_imu(state)
    return state


MESSAGES = {
    "low_state": low_state(),
    "left_hand_state": hand_state("left"),
    "right_hand_state": hand_state("right"),
    "low_command": low_command(),
    "hand_command": hand_command(),
    "battery": battery(),
    "odometry": odometry(),
    "imu": imu(),
    "request": request(),
    "response": response(),
}
packed = {name: zlib.compress(message.serialize(), 9) for name, message in MESSAGES.items()}
print(json.dumps({name: base64.b64encode(content).decode() for name, content in packed.items()}, indent=1))
