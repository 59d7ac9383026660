"""The head camera as LeRobot's and teleimager's clients read it: JPEG over ZMQ, drawn only while a client listens."""

from __future__ import annotations

import base64
import io
import json
import time
from typing import Any

import numpy as np
import zmq
from numpy.typing import NDArray
from PIL import Image

from .sockets import Publisher, bound, received

LEROBOT_PORT = 5555
"""Port of LeRobot's `ZMQCamera`: JSON with JPEG in base64."""

TELEIMAGER_PORT = 55555
"""Port of teleimager's stream: one JPEG a message."""

CONFIGURATION_PORT = 60000
"""Port where teleimager's clients ask for the configuration."""

CAMERA = "head_camera"
"""Name of the camera, as LeRobot and teleimager call it."""

WIDTH, HEIGHT = 640, 480
"""Size of the pictures sent, which clients expect; the simulated camera has 320 by 240 pixels."""

JPEG_QUALITY = 85


def jpeg(rgb: NDArray[np.uint8]) -> bytes:
    """Returns a picture as JPEG, enlarged to 640 by 480."""
    stream = io.BytesIO()
    Image.fromarray(rgb).resize((WIDTH, HEIGHT), Image.Resampling.BILINEAR).save(stream, "JPEG", quality=JPEG_QUALITY)
    return stream.getvalue()


def lerobot_payload(picture: bytes, time_s: float) -> bytes:
    """Returns the message of LeRobot's `ImageServer` with one camera."""
    images = {CAMERA: base64.b64encode(picture).decode()}
    return json.dumps({"timestamps": {CAMERA: time_s}, "images": images}).encode()


def teleimager_configuration(fps: float) -> dict[str, Any]:
    """Returns the answer of teleimager's server to a client that asks for its cameras."""
    camera = {
        "enable_zmq": True,
        "zmq_port": TELEIMAGER_PORT,
        "enable_webrtc": False,
        "webrtc_port": 0,
        "image_shape": [HEIGHT, WIDTH],
        "binocular": False,
        "fps": fps,
        "type": "tandem",
    }
    return {"camera": {CAMERA: camera}}


class Cameras:
    """The camera sockets of one robot. All calls come from one thread."""

    def __init__(self, address: str, fps: float) -> None:
        self._lerobot = Publisher(address, LEROBOT_PORT)
        self._teleimager = Publisher(address, TELEIMAGER_PORT)
        self._configuration = json.dumps(teleimager_configuration(fps)).encode()
        self._requests = bound(zmq.REP, address, CONFIGURATION_PORT)

    def answer(self) -> None:
        """Answers clients that ask for the configuration."""
        while received(self._requests) is not None:
            self._requests.send(self._configuration)

    def are_watched(self) -> bool:
        """Returns whether a client listens to a camera."""
        lerobot, teleimager = self._lerobot.has_subscribers(), self._teleimager.has_subscribers()
        return lerobot or teleimager

    def publish(self, rgb: NDArray[np.uint8]) -> None:
        """Sends a picture to the clients that listen."""
        picture = jpeg(rgb)
        if self._teleimager.has_subscribers():
            self._teleimager.send(picture)
        if self._lerobot.has_subscribers():
            self._lerobot.send(lerobot_payload(picture, time.time()))
