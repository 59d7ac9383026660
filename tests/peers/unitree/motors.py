"""The motors of a robot over Unitree's Python SDK: `rt/lowstate`, `rt/lowcmd` and the switch of modes."""

import time

from unitree_sdk2py.comm.motion_switcher.motion_switcher_client import MotionSwitcherClient
from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelPublisher, ChannelSubscriber
from unitree_sdk2py.idl.default import unitree_hg_msg_dds__LowCmd_
from unitree_sdk2py.idl.unitree_go.msg.dds_ import SportModeState_
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import LowCmd_, LowState_
from unitree_sdk2py.utils.crc import CRC

STATE, ODOMETRY = "rt/lowstate", "rt/odommodestate"


class Motors:
    """The motors of the robot in a DDS domain."""

    def __init__(self, domain):
        """Opens the topics and waits for the first states."""
        ChannelFactoryInitialize(domain, "lo")
        self._latest, self._subscribers = {}, []
        for topic, kind in ((STATE, LowState_), (ODOMETRY, SportModeState_)):
            subscriber = ChannelSubscriber(topic, kind)
            subscriber.Init(lambda message, topic=topic: self._latest.update({topic: message}), 10)
            self._subscribers.append(subscriber)
        self._publisher, self._crc = ChannelPublisher("rt/lowcmd", LowCmd_), CRC()
        self._publisher.Init()
        self.switcher = MotionSwitcherClient()
        self.switcher.SetTimeout(5.0)
        self.switcher.Init()
        while len(self._latest) < 2:
            time.sleep(0.1)
        time.sleep(1.0)

    @property
    def state(self):
        """The newest state of the motors and the IMU."""
        return self._latest[STATE]

    @property
    def position_m(self):
        """The newest position of the pelvis."""
        return self._latest[ODOMETRY].position

    def release(self):
        """Takes the motors from the robot's own controllers."""
        while self.switcher.CheckMode()[1]["name"]:
            self.switcher.ReleaseMode()

    def command(self):
        """Returns a command without setpoints."""
        message = unitree_hg_msg_dds__LowCmd_()
        message.mode_pr, message.mode_machine = 0, self.state.mode_machine
        return message

    def send(self, message):
        """Publishes a command with its checksum."""
        message.crc = self._crc.Crc(message)
        self._publisher.Write(message)
