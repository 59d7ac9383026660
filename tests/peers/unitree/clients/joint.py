"""Unitree's Python SDK drives every motor of robot A: gains also act on the legs, and no controller balances.

`run.py` starts it with the DDS domain of the robot, whose bridge has `--joint-control`.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from motors import Motors  # noqa: E402

BODY = range(29)
KNEE, ELBOW = 3, 18
STANDS_M, LIES_M = 0.6, 0.4

robot = Motors(int(sys.argv[1]))


def motors():
    return robot.state.motor_state


def height_m():
    return robot.position_m[2]


def gains(motor):
    """The gains that LeRobot sends: legs, waist, arms."""
    legs = {3: (300.0, 4.0), 4: (40.0, 2.0), 5: (40.0, 2.0)}
    return legs.get(motor % 6, (150.0, 2.0)) if motor < 12 else (250.0, 5.0) if motor < 15 else (80.0, 3.0)


def command(targets, stiff):
    message = robot.command()
    for motor in BODY:
        joint = message.motor_cmd[motor]
        joint.mode, joint.q = 1, targets[motor]
        joint.kp, joint.kd = gains(motor) if stiff else (0.0, 0.0)
    return message


def drive(targets, seconds, stiff):
    """Sends a command at 250 Hz; returns the difference of each leg's torque from its law, at the last state [N m]."""
    message = command(targets, stiff)
    for _ in range(int(250 * seconds)):
        robot.send(message)
        time.sleep(0.004)
    state = motors()
    law = lambda motor: gains(motor)[0] * (targets[motor] - state[motor].q) - gains(motor)[1] * state[motor].dq
    return [abs(law(motor) - state[motor].tau_est) for motor in range(12)]


resting = {motor: motors()[motor].q for motor in BODY}
assert height_m() > STANDS_M, height_m()
robot.release()
off_n_m = drive({**resting, ELBOW: resting[ELBOW] + 0.3}, 0.3, stiff=True)
assert robot.switcher.SelectMode("ai")[0] == 0
time.sleep(3.0)
print(f"torques of the legs are within {max(off_n_m):.1f} N m of their gains; handed back, the pelvis is at {height_m():.2f} m")
assert max(off_n_m) < 8.0 and height_m() > STANDS_M, (off_n_m, height_m())
robot.release()
drive(resting, 3.0, stiff=False)
print(f"limp, it is at {height_m():.2f} m")
assert height_m() < LIES_M, height_m()
print("fine")
