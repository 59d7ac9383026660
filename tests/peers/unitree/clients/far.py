"""Unitree's C++ SDK, by its binding `far-unitree-sdk`, drives robot A, which is in domain 0, the only one of this SDK.

Commands are ignored until the mode is released; the SDK drops states with a wrong checksum and then tells zeros.
"""

import os
import subprocess
import sys
import time

import unitree_interface

RELEASE = """
from unitree_sdk2py.core.channel import ChannelFactoryInitialize
from unitree_sdk2py.comm.motion_switcher.motion_switcher_client import MotionSwitcherClient
ChannelFactoryInitialize(0, "lo")
switcher = MotionSwitcherClient(); switcher.SetTimeout(5.0); switcher.Init()
while (mode := switcher.CheckMode()[1])["name"]:
    switcher.ReleaseMode()
"""
WAIST_YAW, KNEE = 12, 3

robot = unitree_interface.UnitreeInterface.create_g1("lo", unitree_interface.MessageType.HG)
time.sleep(1.5)
state = robot.read_low_state()
resting = list(state.motor.q)
assert state.mode_machine == 5 and abs(resting[KNEE]) > 0.1, "no state, or one with a wrong checksum"


def moved(seconds):
    """Commands a turn of the waist, and returns the angles by which the waist and the knee have turned."""
    command = robot.create_zero_command()
    goal = list(resting)
    goal[WAIST_YAW] += 0.3
    goal[KNEE] += 0.3
    for _ in range(int(seconds / 0.002)):
        command.q_target, command.kp, command.kd = goal, [60.0] * 29, [1.5] * 29
        robot.write_low_command(command)
        time.sleep(0.002)
    now = robot.read_low_state().motor.q
    return now[WAIST_YAW] - resting[WAIST_YAW], now[KNEE] - resting[KNEE]


before = moved(2.0)
subprocess.run([sys.executable, "-c", RELEASE], check=True)
after = moved(3.0)
print(f"before ReleaseMode the waist turns {before[0]:.3f} rad, after it {after[0]:.3f}; the knee {after[1]:.3f} of 0.3")
assert abs(before[0]) < 0.01 and abs(after[0] - 0.3) < 0.02 and abs(after[1]) < 0.1
print("fine", flush=True)
# Not `sys.exit`: destructors of the SDK's DDS library race with its threads, which aborts now and then.
os._exit(0)
