"""A teleoperator of LeRobot without a person. It swings the arms and the waist of a G1 about the pose at its start."""

import math
import time
from dataclasses import dataclass

from lerobot.robots.unitree_g1.g1_utils import G1_29_JointIndex
from lerobot.teleoperators import Teleoperator, TeleoperatorConfig

SWINGS_RAD = {"kWaistYaw": 0.2, "kLeftElbow": -0.3, "kRightElbow": -0.3, "kLeftShoulderPitch": -0.2, "kRightShoulderPitch": -0.2}
PERIOD_S = 2.0
STANDING_RAD = {"kLeftHipPitch": -0.2, "kRightHipPitch": -0.2, "kLeftKnee": 0.4, "kRightKnee": 0.4}
STANDING_RAD |= {"kLeftAnklePitch": -0.2, "kRightAnklePitch": -0.2}


@TeleoperatorConfig.register_subclass("scripted")
@dataclass
class ScriptedTeleoperatorConfig(TeleoperatorConfig):
    """Configuration without settings."""


class ScriptedTeleoperator(Teleoperator):
    """The script in the form of LeRobot's class."""

    config_class = ScriptedTeleoperatorConfig
    name = "scripted"

    def __init__(self, config):
        super().__init__(config)
        self._begun_s = None

    @property
    def action_features(self):
        return {f"{motor.name}.q": float for motor in G1_29_JointIndex}

    @property
    def feedback_features(self):
        return {}

    @property
    def is_connected(self):
        return self._begun_s is not None

    @property
    def is_calibrated(self):
        return True

    def connect(self, calibrate=True):
        self._begun_s = time.monotonic()

    def calibrate(self):
        pass

    def configure(self):
        pass

    def get_action(self):
        share = 0.5 - 0.5 * math.cos(math.tau * (time.monotonic() - self._begun_s) / PERIOD_S)
        rest = {motor.name: STANDING_RAD.get(motor.name, 0.0) for motor in G1_29_JointIndex}
        return {f"{name}.q": angle + share * SWINGS_RAD.get(name, 0.0) for name, angle in rest.items()}

    def send_feedback(self, feedback):
        pass

    def disconnect(self):
        self._begun_s = None
