"""A program that thinks for 4 s between its commands: under the clock `hold` the tick of states is paused meanwhile.

`run.py` starts it with the DDS domain of the robot and the clock.
"""

import sys
import time

from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelSubscriber
from unitree_sdk2py.g1.loco.g1_loco_client import LocoClient
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import LowState_

ChannelFactoryInitialize(int(sys.argv[1]), "lo")
latest, count = [None], [0]


def keep(message):
    latest[0] = message
    count[0] += 1


subscriber = ChannelSubscriber("rt/lowstate", LowState_)
subscriber.Init(keep, 10)
loco = LocoClient()
loco.SetTimeout(5.0)
loco.Init()
time.sleep(1.0)
for _ in range(2):
    started = latest[0].tick
    assert loco.SetVelocity(-0.1, 0, 0, 1.0) == 0
    time.sleep(2.2)
    tick, states = latest[0].tick, count[0]
    assert tick - started >= 1000, "a velocity in force lets time pass"
    time.sleep(4.0)
    passed_ms, came = latest[0].tick - tick, count[0] - states
    print(f"while the program thinks for 4 s, {passed_ms} ms pass and {came} states come")
    assert came > 400
    assert passed_ms == 0 if sys.argv[2] == "hold" else passed_ms > 1000
print("fine")
