"""Measures the time from a write to `rt/arm_sdk` until `rt/lowstate` shows a motion of 2 mrad, and the rate of states.

`run.py` starts it with the DDS domain of the robot.
"""

import itertools
import statistics
import sys
import time

from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelPublisher, ChannelSubscriber
from unitree_sdk2py.idl.default import unitree_hg_msg_dds__LowCmd_
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import LowCmd_, LowState_
from unitree_sdk2py.utils.crc import CRC

JOINTS, WEIGHT, WRIST = range(12, 29), 29, 21

ChannelFactoryInitialize(int(sys.argv[1]), "lo")
latest, times_s, ticks = [None], [], []


def keep(message):
    latest[0] = message
    times_s.append(time.time())
    ticks.append(message.tick)


subscriber = ChannelSubscriber("rt/lowstate", LowState_)
subscriber.Init(keep, 10)
publisher, crc = ChannelPublisher("rt/arm_sdk", LowCmd_), CRC()
publisher.Init()
time.sleep(1.5)
resting = {motor: latest[0].motor_state[motor].q for motor in JOINTS}
command = unitree_hg_msg_dds__LowCmd_()
command.motor_cmd[WEIGHT].q = 1.0


def send(targets):
    for motor, target in targets.items():
        joint = command.motor_cmd[motor]
        joint.q, joint.kp, joint.kd = target, 60.0, 1.5
    command.crc = crc.Crc(command)
    publisher.Write(command)


for _ in range(50):
    send(resting)
    time.sleep(0.02)
delays_ms = []
for turn in range(20):
    before, sent_s = latest[0].motor_state[WRIST].q, time.time()
    send({**resting, WRIST: resting[WRIST] + (0.3 if turn % 2 == 0 else 0.0)})
    while abs(latest[0].motor_state[WRIST].q - before) < 2e-3 and time.time() - sent_s < 1:
        time.sleep(0.0005)
    delays_ms.append(1000 * (time.time() - sent_s))
    time.sleep(0.6 + 0.007 * turn)
wall_s = times_s[-1] - times_s[0]
longest_ms = 1000 * max(later - earlier for earlier, later in itertools.pairwise(times_s))
median_ms, realtime = statistics.median(delays_ms), (ticks[-1] - ticks[0]) / 1000 / wall_s
print(
    f"domain {sys.argv[1]}: to 2 mrad {min(delays_ms):.0f} to {max(delays_ms):.0f} ms, median {median_ms:.0f}; "
    f"{len(times_s) / wall_s:.0f} states a second, {longest_ms:.0f} ms between two at most; {realtime:.2f} of real time"
)
print("fine")
