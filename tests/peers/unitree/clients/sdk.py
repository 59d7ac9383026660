"""Unitree's Python SDK drives robot A: state, locomotion, modes, arms, hands, and what the simulator cannot do.

`run.py` starts it with the DDS domain of the robot.
"""

import sys
import time

from unitree_sdk2py.comm.motion_switcher.motion_switcher_client import MotionSwitcherClient
from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelPublisher, ChannelSubscriber
from unitree_sdk2py.g1.arm.g1_arm_action_client import G1ArmActionClient
from unitree_sdk2py.g1.loco.g1_loco_client import LocoClient
from unitree_sdk2py.idl.default import unitree_hg_msg_dds__HandCmd_, unitree_hg_msg_dds__LowCmd_
from unitree_sdk2py.idl.unitree_go.msg.dds_ import SportModeState_
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import BmsState_, HandCmd_, HandState_, IMUState_, LowCmd_, LowState_
from unitree_sdk2py.utils.crc import CRC

CANNOT = 3203
WAIST_YAW, LEFT_ELBOW, WEIGHT = 12, 18, 29
ARMS_AND_WAIST = [*range(15, 29), 12, 13, 14]

ChannelFactoryInitialize(int(sys.argv[1]), "lo")
latest, counts, subscribers = {}, {}, []


def subscribe(topic, kind):
    """Keeps the newest message of a topic, and counts all."""

    def keep(message):
        latest[topic] = message
        counts[topic] = counts.get(topic, 0) + 1

    subscriber = ChannelSubscriber(topic, kind)
    subscriber.Init(keep, 10)
    subscribers.append(subscriber)


TOPICS = {
    "rt/lowstate": LowState_,
    "rt/lf/lowstate": LowState_,
    "rt/secondary_imu": IMUState_,
    "rt/odommodestate": SportModeState_,
    "rt/lf/bmsstate": BmsState_,
    "rt/dex3/left/state": HandState_,
    "rt/dex3/right/state": HandState_,
}


def q(motor):
    return latest["rt/lowstate"].motor_state[motor].q


def check_states():
    """Checks the rate and the checksum of every topic."""
    time.sleep(1.0)
    before, begun_s = dict(counts), time.time()
    time.sleep(2.0)
    rates = {topic: (counts[topic] - before.get(topic, 0)) / (time.time() - begun_s) for topic in TOPICS}
    print({topic: round(rate) for topic, rate in rates.items()})
    assert rates["rt/lf/bmsstate"] > 5 and rates["rt/dex3/right/state"] > 60, rates
    low = latest["rt/lowstate"]
    assert CRC().Crc(low) == low.crc and low.mode_machine == 5 and low.mode_pr == 0
    assert latest["rt/lf/bmsstate"].soc == 100
    assert abs(sum(part**2 for part in latest["rt/secondary_imu"].quaternion) - 1) < 1e-3
    assert abs(latest["rt/odommodestate"].position[2] - 0.76) < 0.05
    assert any(motor.q for motor in latest["rt/dex3/left/state"].motor_state), "xr_teleoperate waits while all are zero"
    assert len(latest["rt/dex3/left/state"].press_sensor_state) == 9


def check_services():
    """Checks that supported calls are executed, and that all others get 3203."""
    switcher = MotionSwitcherClient()
    switcher.SetTimeout(5.0)
    switcher.Init()
    assert switcher.CheckMode() == (0, {"form": "0", "name": "ai"})
    loco = LocoClient()
    loco.SetTimeout(5.0)
    loco.Init()
    x_m = latest["rt/odommodestate"].position[0]
    assert loco.SetVelocity(-0.2, 0, 0, 2.0) == 0
    time.sleep(3.5)
    walked_m = latest["rt/odommodestate"].position[0] - x_m
    knee = q(3)
    assert loco.SetStandHeight(0.0) == 0
    time.sleep(2.0)
    print(f"walked {walked_m:.2f} m; the knee bends from {knee:.2f} to {q(3):.2f} rad in the low stand")
    assert -0.6 < walked_m < -0.2 and q(3) > knee + 0.3
    loco.HighStand()
    assert loco.SetFsmId(500) == 0 and loco.SetFsmId(1) == CANNOT and loco.SetTaskId(0) == CANNOT
    arm = G1ArmActionClient()
    arm.SetTimeout(5.0)
    arm.Init()
    assert arm.ExecuteAction(27) == CANNOT and arm.GetActionList() == (0, [])
    time.sleep(1.0)


def check_arms():
    """Checks that `rt/arm_sdk` moves the joints by its weight, and that a message with a wrong checksum is ignored."""
    publisher, crc = ChannelPublisher("rt/arm_sdk", LowCmd_), CRC()
    publisher.Init()
    command = unitree_hg_msg_dds__LowCmd_()
    resting = {motor: q(motor) for motor in ARMS_AND_WAIST}
    goal = {**resting, WAIST_YAW: resting[WAIST_YAW] + 0.4, LEFT_ELBOW: resting[LEFT_ELBOW] + 0.5}

    def send(targets, weight, seconds, wrong=0):
        command.motor_cmd[WEIGHT].q = weight
        for motor, target in targets.items():
            joint = command.motor_cmd[motor]
            joint.q, joint.kp, joint.kd = target, 60.0, 1.5
        command.crc = crc.Crc(command) ^ wrong
        for _ in range(int(50 * seconds)):
            publisher.Write(command)
            time.sleep(0.02)

    send(goal, 1.0, 1.0, wrong=1)
    assert abs(q(WAIST_YAW) - resting[WAIST_YAW]) < 0.01, "a command with a wrong checksum was followed"
    send(goal, 1.0, 2.0)
    errors = {motor: round(q(motor) - goal[motor], 4) for motor in (WAIST_YAW, LEFT_ELBOW)}
    print("errors of arm_sdk in rad", errors)
    assert abs(errors[WAIST_YAW]) < 0.005 and abs(errors[LEFT_ELBOW]) < 0.03, errors
    send(goal, 0.5, 1.5)
    assert abs(q(WAIST_YAW) - resting[WAIST_YAW] - 0.2) < 0.01, "half the weight moves half the way"
    send(goal, 0.0, 1.0)


def check_hands():
    """Motors 3 and 4 of the right hand are its index finger."""
    publisher = ChannelPublisher("rt/dex3/right/cmd", HandCmd_)
    publisher.Init()
    command, state = unitree_hg_msg_dds__HandCmd_(), latest["rt/dex3/right/state"]
    for index in range(7):
        motor = command.motor_cmd[index]
        motor.mode, motor.kp, motor.kd = index | 1 << 4, 1.5, 0.2
        motor.q = state.motor_state[index].q + (0.6 if index in (3, 4) else 0.0)
    for _ in range(100):
        publisher.Write(command)
        time.sleep(0.01)
    angles = [round(motor.q, 3) for motor in latest["rt/dex3/right/state"].motor_state]
    print("right hand", angles)
    assert min(angles[3:5]) > 0.5 and max(map(abs, angles[5:7])) < 0.1


for name, kind in TOPICS.items():
    subscribe(name, kind)
check_states()
check_services()
check_arms()
check_hands()
print("fine")
