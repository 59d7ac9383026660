"""The messages that a robot publishes, filled by NumPy."""

from __future__ import annotations

from ..wire.joints import BODY, BODY_MOTORS, HANDS
from ..wire.layout import (
    BATTERY,
    HAND_MOTORS,
    HAND_STATE,
    IMU,
    LOW_STATE,
    ODOMETRY,
    PRESS_SENSORS,
    Record,
    blank,
    serialized,
    state_crc,
)
from .sensing import Moment, Vector, resting_force, roll_pitch_yaw, torso_of

MODE_MACHINE = 5
"""`mode_machine` of a G1 with 29 degrees of freedom."""

SERIES_ANKLE = 0
"""`mode_pr` of joints in series (pitch, roll); 1 means parallel rods (A, B)."""

ENABLED = 1
"""`mode` of a motor that is enabled."""

MOTOR_TEMPERATURES = (35, 40)
MOTOR_VOLTAGE = 54.0
IMU_TEMPERATURE = 40
STATE_OF_CHARGE = 100
"""Constants in place of quantities that are not simulated."""

SMALLEST_ANGLE_RAD = 1e-6
"""Replaces an angle of exactly zero of a finger: xr_teleoperate waits until an angle of a hand differs from zero."""


def _fill_imu(imu: Record, quaternion: Vector, gyro: Vector, accelerometer: Vector) -> None:
    imu["quaternion"][...] = quaternion
    imu["gyroscope"][...] = gyro
    imu["accelerometer"][...] = accelerometer
    imu["rpy"][...] = roll_pitch_yaw(quaternion)


class Messages:
    """The messages of one robot; constants are filled in once."""

    def __init__(self) -> None:
        low = blank(LOW_STATE)
        low["mode_pr"], low["mode_machine"] = SERIES_ANKLE, MODE_MACHINE
        low["first_mode"] = ENABLED
        low["imu"]["temperature"] = IMU_TEMPERATURE
        body = low["motors"][:BODY_MOTORS]
        body["temperature"][...], body["vol"] = MOTOR_TEMPERATURES, MOTOR_VOLTAGE
        low["motors"]["next_mode"][: BODY_MOTORS - 1] = ENABLED
        self._low = low
        self._hands = {side: _blank_hand() for side in HANDS}
        self._torso = blank(IMU)
        self._torso["temperature"] = IMU_TEMPERATURE
        self._odometry = blank(ODOMETRY)
        self._odometry["temperature"] = IMU_TEMPERATURE
        battery = blank(BATTERY)
        battery["soc"] = battery["soh"] = STATE_OF_CHARGE
        battery["bmsvoltage"][...] = 1000 * MOTOR_VOLTAGE
        battery["temperature"][...] = MOTOR_TEMPERATURES[0]
        self.battery = serialized(battery)

    @property
    def low_record(self) -> Record:
        """The last `LowState_`."""
        return self._low

    def low_state(self, moment: Moment) -> bytes:
        """Returns `LowState_` of a moment, whose tick is the simulated time in milliseconds."""
        low = self._low
        low["tick"] = round(1000 * moment.time_s)
        body, joints = low["motors"][:BODY_MOTORS], moment.joints[:, BODY]
        body["q"], body["dq"], body["ddq"], body["tau_est"] = joints
        _fill_imu(low["imu"], moment.quaternion_wxyz, moment.gyro_rad_s, moment.accelerometer_m_s2)
        low["crc"] = state_crc(low)
        return serialized(low)

    def hand_state(self, side: str, moment: Moment) -> bytes:
        """Returns `HandState_` of the left or right hand."""
        hand = self._hands[side]
        joints = moment.joints[:, HANDS[side]]
        motors = hand["motors"]
        motors["q"], motors["dq"], motors["ddq"], motors["tau_est"] = joints
        motors["q"][motors["q"] == 0] = SMALLEST_ANGLE_RAD
        return serialized(hand)

    def torso_imu(self, moment: Moment) -> bytes:
        """Returns `IMUState_` of the torso."""
        quaternion, gyro = torso_of(moment)
        _fill_imu(self._torso, quaternion, gyro, resting_force(quaternion))
        return serialized(self._torso)

    def odometry(self, moment: Moment) -> bytes:
        """Returns `SportModeState_`: position and velocity in the start frame, yaw rate in the pelvis frame."""
        record = self._odometry
        record["sec"], record["nanosec"] = divmod(round(1e9 * moment.time_s), 10**9)
        _fill_imu(record, moment.quaternion_wxyz, moment.gyro_rad_s, moment.accelerometer_m_s2)
        record["position"][...] = moment.position_m
        record["body_height"] = moment.position_m[2]
        record["velocity"][...] = moment.velocity_m_s
        record["yaw_speed"] = moment.gyro_rad_s[2]
        return serialized(record)


def _blank_hand() -> Record:
    hand = blank(HAND_STATE)
    hand["motor_count"], hand["press_count"] = HAND_MOTORS, PRESS_SENSORS
    hand["first_mode"] = ENABLED
    hand["motors"]["temperature"][...], hand["motors"]["vol"] = MOTOR_TEMPERATURES, MOTOR_VOLTAGE
    hand["motors"]["next_mode"][: HAND_MOTORS - 1] = ENABLED
    hand["imu"]["quaternion"][0] = 1.0
    hand["imu"]["temperature"] = IMU_TEMPERATURE
    hand["power_v"] = hand["system_v"] = hand["device_v"] = 24.0
    return hand
