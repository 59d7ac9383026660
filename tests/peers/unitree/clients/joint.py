"""Unitree's Python SDK drives every motor of robot A: gains act on legs, too, and nobody balances.

`run.py` starts it with the DDS domain of the robot, whose bridge has `--joint-control`.
"""

import sys
import time

from unitree_sdk2py.comm.motion_switcher.motion_switcher_client import MotionSwitcherClient
from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelPublisher, ChannelSubscriber
from unitree_sdk2py.idl.default import unitree_hg_msg_dds__LowCmd_
from unitree_sdk2py.idl.unitree_go.msg.dds_ import SportModeState_
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import LowCmd_, LowState_
from unitree_sdk2py.utils.crc import CRC

BODY = range(29)
KNEE, ELBOW = 3, 18
STANDS_M, LIES_M = 0.6, 0.4

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


def motors():
    return latest["rt/lowstate"].motor_state


def height_m():
    return latest["rt/odommodestate"].position[2]


def gains(motor):
    """The gains that LeRobot sends: legs, waist, arms."""
    legs = {3: (300.0, 4.0), 4: (40.0, 2.0), 5: (40.0, 2.0)}
    return legs.get(motor % 6, (150.0, 2.0)) if motor < 12 else (250.0, 5.0) if motor < 15 else (80.0, 3.0)


def command(targets, stiff):
    message = unitree_hg_msg_dds__LowCmd_()
    message.mode_pr, message.mode_machine = 0, latest["rt/lowstate"].mode_machine
    for motor in BODY:
        joint = message.motor_cmd[motor]
        joint.mode, joint.q = 1, targets[motor]
        joint.kp, joint.kd = gains(motor) if stiff else (0.0, 0.0)
    message.crc = crc.Crc(message)
    return message


def drive(targets, seconds, stiff):
    """Sends a command at 250 Hz; returns how far each leg's torque is from its law, at the last state [N m]."""
    message = command(targets, stiff)
    for _ in range(int(250 * seconds)):
        publisher.Write(message)
        time.sleep(0.004)
    state = motors()
    law = lambda motor: gains(motor)[0] * (targets[motor] - state[motor].q) - gains(motor)[1] * state[motor].dq
    return [abs(law(motor) - state[motor].tau_est) for motor in range(12)]


def release():
    while switcher.CheckMode()[1]["name"]:
        switcher.ReleaseMode()


while len(latest) < 2:
    time.sleep(0.1)
time.sleep(1.0)
resting = {motor: motors()[motor].q for motor in BODY}
assert height_m() > STANDS_M, height_m()
release()
off_n_m = drive({**resting, ELBOW: resting[ELBOW] + 0.3}, 0.3, stiff=True)
assert switcher.SelectMode("ai")[0] == 0
time.sleep(3.0)
print(f"torques of the legs are within {max(off_n_m):.1f} N m of their gains; handed back, the pelvis is at {height_m():.2f} m")
assert max(off_n_m) < 8.0 and height_m() > STANDS_M, (off_n_m, height_m())
release()
drive(resting, 3.0, stiff=False)
print(f"limp, it is at {height_m():.2f} m")
assert height_m() < LIES_M, height_m()
print("fine")
