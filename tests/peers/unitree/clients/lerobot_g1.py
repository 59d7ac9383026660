"""LeRobot's `UnitreeG1` and `ZMQCamera` drive one robot, whose address is the argument.

Two things are put in place of what cannot be installed here: `torch`, of which only a type is needed, and the name of
Unitree's SDK, which has another one on PyPI. Over ZMQ the SDK is needed for a checksum alone.
"""

import importlib.metadata
import sys
import time
import types

version = importlib.metadata.version
importlib.metadata.version = lambda name: version("unitree-sdk2py-dimos") if name == "unitree-sdk2py" else version(name)


class Torch(types.ModuleType):
    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (), {})


sys.modules.setdefault("torch", Torch("torch"))

from lerobot.cameras.zmq import ZMQCameraConfig  # noqa: E402
from lerobot.robots.unitree_g1.config_unitree_g1 import UnitreeG1Config  # noqa: E402
from lerobot.robots.unitree_g1.unitree_g1 import UnitreeG1  # noqa: E402

address, turn_rad = sys.argv[1], float(sys.argv[2])
camera = ZMQCameraConfig(server_address=address, port=5555, camera_name="head_camera", width=640, height=480, fps=15)
robot = UnitreeG1(UnitreeG1Config(id=address, is_simulation=False, robot_ip=address, cameras={"head": camera}))
robot.connect()
time.sleep(0.5)
first = robot.get_observation()
assert first["head"].shape == (480, 640, 3) and first["head"].mean() > 5
goal = {name: first[name] for name in robot.action_features}
goal["kWaistYaw.q"] += turn_rad
goal["kLeftKnee.q"] += 0.3
begun_s, sent = time.time(), 0
while time.time() - begun_s < 3:
    robot.send_action(goal)
    sent += 1
    time.sleep(1 / 30)
last = robot.get_observation()
turned_rad, knee_rad = (last[name] - first[name] for name in ("kWaistYaw.q", "kLeftKnee.q"))
print(f"{address}: {len(first)} keys, {sent} actions, waist {turned_rad:.3f} of {turn_rad} rad, knee {knee_rad:.3f} of 0.3")
robot.disconnect()
assert abs(turned_rad - turn_rad) < 0.02 and abs(knee_rad) < 0.1
print("fine")
