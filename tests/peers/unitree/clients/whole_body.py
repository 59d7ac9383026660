"""AGILE's velocity policy walks robot A over Unitree's Python SDK: `rt/lowstate` in, `rt/lowcmd` out, at 50 Hz.

`run.py` starts it with the DDS domain of the robot; TANDEM_POLICY names the policy's ONNX file. The environment needs
`onnxruntime` beside its own packages.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "whole_body"))

from policy import KD, KP, POSITION, Agile, State  # noqa: E402
from unitree_sdk2py.comm.motion_switcher.motion_switcher_client import MotionSwitcherClient  # noqa: E402
from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelPublisher, ChannelSubscriber  # noqa: E402
from unitree_sdk2py.idl.default import unitree_hg_msg_dds__LowCmd_  # noqa: E402
from unitree_sdk2py.idl.unitree_go.msg.dds_ import SportModeState_  # noqa: E402
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import LowCmd_, LowState_  # noqa: E402
from unitree_sdk2py.utils.crc import CRC  # noqa: E402

STEP_S, STANDS_S, WALKS_S, STANDS_M = 0.02, 10.0, 10.0, 0.6
LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")
NAMES = [f"{side}_{joint}_joint" for side in ("left", "right") for joint in LEG]
NAMES += [f"waist_{axis}_joint" for axis in ("yaw", "roll", "pitch")]
NAMES += [f"{side}_{joint}_joint" for side in ("left", "right") for joint in ARM]

ChannelFactoryInitialize(int(sys.argv[1]), "lo")
latest, kept = {}, []
for topic, kind in (("rt/lowstate", LowState_), ("rt/odommodestate", SportModeState_)):
    subscriber = ChannelSubscriber(topic, kind)
    subscriber.Init(lambda message, topic=topic: latest.update({topic: message}), 10)
    kept.append(subscriber)
publisher, crc = ChannelPublisher("rt/lowcmd", LowCmd_), CRC()
publisher.Init()
switcher = MotionSwitcherClient()
switcher.SetTimeout(5.0)
switcher.Init()


def state():
    low = latest["rt/lowstate"]
    motors = low.motor_state[: len(NAMES)]
    rates = np.array([motor.dq for motor in motors])
    quaternion, gyro = np.array(low.imu_state.quaternion), np.array(low.imu_state.gyroscope)
    return State(quaternion, gyro, np.array([motor.q for motor in motors]), rates)


def place():
    return np.array(latest["rt/odommodestate"].position)


while len(latest) < 2:
    time.sleep(0.1)
time.sleep(1.0)
policy = Agile(Path(os.environ["TANDEM_POLICY"]), NAMES, state().q_rad)
message = unitree_hg_msg_dds__LowCmd_()
message.mode_pr, message.mode_machine = 0, latest["rt/lowstate"].mode_machine
while switcher.CheckMode()[1]["name"]:
    switcher.ReleaseMode()
begun_s, begun, step = time.monotonic(), place(), 0
while (elapsed_s := time.monotonic() - begun_s) < STANDS_S + WALKS_S:
    setpoints = policy.act(state(), (0.0 if elapsed_s < STANDS_S else -0.3, 0.0, 0.0))
    for motor, joint in enumerate(message.motor_cmd[: len(NAMES)]):
        joint.mode, joint.q = 1, setpoints[POSITION, motor]
        joint.kp, joint.kd = setpoints[KP, motor], setpoints[KD, motor]
    message.crc = crc.Crc(message)
    publisher.Write(message)
    step += 1
    time.sleep(max(0.0, begun_s + step * STEP_S - time.monotonic()))
walked_m = float(np.linalg.norm((place() - begun)[:2]))
print(f"stood {STANDS_S:.0f} s and walked {walked_m:.2f} m backwards in {WALKS_S:.0f} s; the pelvis is at {place()[2]:.2f} m")
assert walked_m > 2.0 and place()[2] > STANDS_M, (walked_m, place())
print("fine")
