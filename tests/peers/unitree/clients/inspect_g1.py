"""`inspect-robots-unitree-g1` drives robot A by `rt/arm_sdk` and its Dex3-1 hands, with teleimager's pictures.

The package always uses domain 0. Its own home pose would press the hands on Handover's table.
"""

import time

import numpy as np
from inspect_robots.scene import Scene
from inspect_robots.types import Action
from inspect_robots_unitree_g1 import G1Config, G1Embodiment

LEFT_ELBOW, RIGHT_HAND, OPEN = 3, 15, 1.0
HOME = (0.6, 0.2, 0.2, -0.9, 0.0, 0.0, 0.0, OPEN, 0.6, -0.2, -0.2, -0.9, 0.0, 0.0, 0.0, OPEN)

config = G1Config(
    iface="lo",
    hand_type="dex3",
    cam_server_address="tcp://127.0.0.2:55555",
    unattended=True,
    weight_ramp_s=1.0,
    home_pose=HOME,
    rest_pose=HOME,
)
robot = G1Embodiment(config)
try:
    # Its `reset` reads the hands at once, and fails until their topics have been discovered.
    robot._connect()
    time.sleep(1.0)
    begun_s = time.time()
    seen = robot.reset(Scene(id="handover", instruction="Pass the bottle."))
    [name, *_] = seen.state
    print(f"reset after {time.time() - begun_s:.1f} s, pictures {[image.shape for image in seen.images.values()]}")
    goal = np.array(seen.state[name], float)[:16]
    goal[LEFT_ELBOW] += 0.3
    goal[RIGHT_HAND] = 0.2
    for _ in range(20):
        seen = robot.step(Action(goal)).observation
    reached = np.array(seen.state[name], float)[:16]
finally:
    robot.close()
print(f"elbow {reached[LEFT_ELBOW]:.3f} of {goal[LEFT_ELBOW]:.3f} rad, hand {reached[RIGHT_HAND]:.3f} of 0.2")
assert abs(reached[LEFT_ELBOW] - goal[LEFT_ELBOW]) < 0.05 and abs(reached[RIGHT_HAND] - 0.2) < 0.05
print("fine")
