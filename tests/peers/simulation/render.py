"""Time of two egocentric pictures of one state, 320 x 240: `mujoco.Renderer`'s on software GL, and ours.

Both draw the kitchen of Handover from the same files with a shadow and four samples a pixel, and are charged the processor
time of all their threads. MuJoCo draws colour alone; ours are colour, depth and ids.

    cargo build --release
    MUJOCO_GL=osmesa python tests/peers/simulation/render.py      # needs Mesa: apt-get install libosmesa6
"""

import json
import os
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("MUJOCO_GL", "osmesa")
# Mesa's threads would only wait for each other on a machine of few cores.
os.environ.setdefault("LP_NUM_THREADS", "0")

import mujoco
import numpy as np

from physics_timing import TANDEM, Kitchen

WIDTH_PX, HEIGHT_PX = 320, 240
STATES = 8
CAMERAS = ["0_egocentric", "1_egocentric"]
MIN_RATIO = 3.0


def theirs_ms():
    """Mean over states; the first pictures, which compile shaders, are not counted."""
    kitchen = Kitchen(2, held=False)
    # As ours.
    kitchen.model.vis.quality.offsamples = 4
    kitchen.model.vis.quality.shadowsize = 1024
    renderer = mujoco.Renderer(kitchen.model, HEIGHT_PX, WIDTH_PX)
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = True
    spans_s = []
    for _ in range(STATES + 2):
        mujoco.mj_step(kitchen.model, kitchen.data)
        begin_s = time.process_time()
        for camera in CAMERAS:
            renderer.update_scene(kitchen.data, camera=camera)
            picture = renderer.render()
        spans_s.append(time.process_time() - begin_s)
        assert picture.std() > 10, "MuJoCo drew an empty picture"
    return 1e3 * float(np.mean(spans_s[2:]))


def ours_ms():
    with tempfile.NamedTemporaryFile(suffix=".json") as file:
        subprocess.run([TANDEM, "bench", "render", "--json", file.name], check=True, stdout=subprocess.DEVNULL)
        cases = json.load(file)["cases"]
    eyes = next(case for case in cases if case["pictures"] == 2)
    assert (eyes["width"], eyes["height"]) == (WIDTH_PX, HEIGHT_PX), eyes
    return eyes["busy_ms"]["median"]


def main():
    # Before and after each other, so that a machine that becomes busy is seen in both.
    pairs = [(theirs_ms(), ours_ms()) for _ in range(2)]
    theirs, ours = (min(column) for column in zip(*pairs))
    print(f"MuJoCo {mujoco.__version__} ({os.environ['MUJOCO_GL']}), two pictures of {WIDTH_PX} x {HEIGHT_PX}, processor time")
    for theirs_once, ours_once in pairs:
        print(f"  MuJoCo {theirs_once:6.1f} ms   Tandem {ours_once:6.1f} ms")
    print(f"best against best: {theirs / ours:.1f} times as fast")
    return theirs / ours >= MIN_RATIO


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
