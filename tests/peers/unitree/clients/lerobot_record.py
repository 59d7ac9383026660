"""`lerobot-record` records one robot, whose address and name are the arguments, for ten episodes; LeRobot loads the result.

The name of Unitree's SDK is put in place, since it has another one on PyPI. A script moves the arms in place of a person.
"""

import importlib.metadata
import sys
import tempfile
from pathlib import Path

version = importlib.metadata.version
importlib.metadata.version = lambda name: version("unitree-sdk2py-dimos") if name == "unitree-sdk2py" else version(name)

import scripted_teleoperator  # noqa: E402, F401
from lerobot.datasets import LeRobotDataset  # noqa: E402
from lerobot.scripts import lerobot_record  # noqa: E402

EPISODES, EPISODE_S, RATE_HZ, SIZE = 10, 3, 10, (640, 480)
address, robot = sys.argv[1:]
folder = Path(tempfile.mkdtemp()) / "recorded"
camera = f"{{type: zmq, server_address: {address}, port: 5555, camera_name: head_camera, width: 640, height: 480, fps: 10}}"
sys.argv = [
    "lerobot-record",
    *("--robot.type=unitree_g1", "--robot.is_simulation=false", f"--robot.robot_ip={address}", f"--robot.id={robot}"),
    f"--robot.cameras={{head: {camera}}}",
    "--teleop.type=scripted",
    *(f"--dataset.repo_id=local/handover_{robot}", f"--dataset.root={folder}", "--dataset.push_to_hub=false"),
    *(f"--dataset.num_episodes={EPISODES}", f"--dataset.episode_time_s={EPISODE_S}", "--dataset.reset_time_s=0.5"),
    *(f"--dataset.fps={RATE_HZ}", "--dataset.single_task=Swing the arms.", "--play_sounds=false"),
    *("--dataset.rgb_encoder.vcodec=h264", "--dataset.rgb_encoder.preset=ultrafast"),
]
lerobot_record.main()

data = LeRobotDataset(f"local/handover_{robot}", root=folder)
first, last = data[0], data[len(data) - 1]
state, action = (data.meta.features[key]["names"] for key in ("observation.state", "action"))
elbow = action.index("kLeftElbow.q")
lowest = min(float(row["action"][elbow]) for row in data.hf_dataset)
print(
    f"{robot}: {data.meta.total_episodes} episodes, {len(data)} rows, {len(state)} numbers of state, {len(action)} of action, "
    f"images {tuple(first['observation.images.head'].shape)}, elbow to {lowest:.2f} rad"
)
assert data.meta.total_episodes == EPISODES and len(action) == 29 and lowest < -0.25
assert len(data) > 0.5 * EPISODES * EPISODE_S * RATE_HZ, "frames are missing"
assert tuple(first["observation.images.head"].shape) == (3, SIZE[1], SIZE[0]) and float(last["observation.images.head"].mean()) > 0.02
measured = [float(row["observation.state"][state.index("kLeftElbow.q")]) for row in data.hf_dataset]
assert max(measured) - min(measured) > 0.2, "the robot has not moved"
print("fine")
