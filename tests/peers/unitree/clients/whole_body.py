"""AGILE's velocity policy walks robot A over Unitree's Python SDK: `rt/lowstate` in, `rt/lowcmd` out, at 50 Hz.

`run.py` starts it with the DDS domain of the robot; TANDEM_POLICY names the policy's ONNX file. The environment needs
`onnxruntime` beside its own packages.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np

UNITREE = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(UNITREE), str(UNITREE.parent / "whole_body")]

from motors import Motors  # noqa: E402
from policy import KD, KP, POSITION, Agile, State  # noqa: E402

STEP_S, STANDS_S, WALKS_S, STANDS_M = 0.02, 10.0, 10.0, 0.6
LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")
NAMES = [f"{side}_{joint}_joint" for side in ("left", "right") for joint in LEG]
NAMES += [f"waist_{axis}_joint" for axis in ("yaw", "roll", "pitch")]
NAMES += [f"{side}_{joint}_joint" for side in ("left", "right") for joint in ARM]

robot = Motors(int(sys.argv[1]))


def state():
    low = robot.state
    motors = low.motor_state[: len(NAMES)]
    rates = np.array([motor.dq for motor in motors])
    quaternion, gyro = np.array(low.imu_state.quaternion), np.array(low.imu_state.gyroscope)
    return State(quaternion, gyro, np.array([motor.q for motor in motors]), rates)


def place():
    return np.array(robot.position_m)


policy = Agile(Path(os.environ["TANDEM_POLICY"]), NAMES, state().q_rad)
message = robot.command()
robot.release()
begun_s, begun, step = time.monotonic(), place(), 0
while (elapsed_s := time.monotonic() - begun_s) < STANDS_S + WALKS_S:
    setpoints = policy.act(state(), (0.0 if elapsed_s < STANDS_S else -0.3, 0.0, 0.0))
    for motor, joint in enumerate(message.motor_cmd[: len(NAMES)]):
        joint.mode, joint.q = 1, setpoints[POSITION, motor]
        joint.kp, joint.kd = setpoints[KP, motor], setpoints[KD, motor]
    robot.send(message)
    step += 1
    time.sleep(max(0.0, begun_s + step * STEP_S - time.monotonic()))
walked_m = float(np.linalg.norm((place() - begun)[:2]))
print(f"stood {STANDS_S:.0f} s and walked {walked_m:.2f} m backwards in {WALKS_S:.0f} s; the pelvis is at {place()[2]:.2f} m")
assert walked_m > 2.0 and place()[2] > STANDS_M, (walked_m, place())
print("fine")
