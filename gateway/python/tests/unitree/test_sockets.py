"""Messages over ZMQ."""

from __future__ import annotations

import base64
import io
import json

import numpy as np
import pytest

pytest.importorskip("zmq")
image = pytest.importorskip("PIL.Image")

from tandem_unitree.robot.messages import Messages  # noqa: E402
from tandem_unitree.robot.sensing import Moment  # noqa: E402
from tandem_unitree.transport.cameras import jpeg, lerobot_payload, teleimager_configuration  # noqa: E402
from tandem_unitree.transport.lerobot import command_of, state_payload  # noqa: E402
from tandem_unitree.wire.layout import modes_of  # noqa: E402


def test_a_state_has_the_fields_that_lerobot_reads() -> None:
    joints = np.ones((4, 1)) * np.arange(43.0)
    moment = Moment(1.0, joints, np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3), np.zeros(3), False)
    messages = Messages()
    messages.low_state(moment)
    told = json.loads(state_payload(messages.low_record))
    assert told["topic"] == "rt/lowstate" and told["data"]["mode_machine"] == 5
    motors = told["data"]["motor_state"]
    assert len(motors) == 35 and motors[22] == {"q": 29.0, "dq": 29.0, "tau_est": 29.0, "temperature": 37.5}
    assert told["data"]["imu_state"]["quaternion"] == [1, 0, 0, 0]
    assert len(base64.b64decode(told["data"]["wireless_remote"])) == 40


def test_a_command_of_lerobot_is_read() -> None:
    motors = [{"mode": 1, "q": 0.1 * index, "dq": 0, "kp": 80.0, "kd": 3.0, "tau": 0.0} for index in range(35)]
    message = {"topic": "rt/lowcmd", "data": {"mode_pr": 0, "mode_machine": 5, "motor_cmd": motors}}
    record = command_of(json.dumps(message).encode())
    assert record is not None and np.allclose(record["motors"]["q"], 0.1 * np.arange(35))
    assert modes_of(record).tolist() == [1] * 35 and record["motors"]["kp"][34] == 80


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"[]",
        b'{"topic": "rt/lowstate", "data": {}}',
        b'{"topic": "rt/lowcmd"}',
        b'{"topic": "rt/lowcmd", "data": {"motor_cmd": []}}',
        b'{"topic": "rt/lowcmd", "data": {"motor_cmd": [{"q": "high"}]}}',
        b'{"topic": "rt/lowcmd", "data": {"motor_cmd": 5}}',
    ],
)
def test_what_is_no_command_is_left_out(payload: bytes) -> None:
    assert command_of(payload) is None


def test_pictures_are_enlarged_jpegs() -> None:
    rgb = np.zeros((240, 320, 3), np.uint8)
    rgb[:, 160:] = 255
    told = json.loads(lerobot_payload(jpeg(rgb), 2.5))
    assert told["timestamps"] == {"head_camera": 2.5}
    picture = image.open(io.BytesIO(base64.b64decode(told["images"]["head_camera"])))
    assert picture.size == (640, 480) and picture.format == "JPEG"
    pixels = np.asarray(picture)
    assert pixels[240, 100].max() < 20 and pixels[240, 600].min() > 235
    camera = teleimager_configuration(15.0)["camera"]["head_camera"]
    assert camera["zmq_port"] == 55555 and camera["image_shape"] == [480, 640] and not camera["enable_webrtc"]
