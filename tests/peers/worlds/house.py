"""Durations of loading a house of SceneSmith's shape, and a mesh of a million triangles.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install -r tests/peers/worlds/worlds.txt
    cargo build --release --workspace --examples
    /tmp/peers/bin/python tests/peers/worlds/house.py /tmp/house

The house is written as SceneSmith exports its own: Drake's directives, one SDF file per object, a glTF file with an image for
what is drawn, and convex OBJ files for what collides. Its objects are pots with noise on them, of many triangles. It is
imported, and then measured: the first start of an episode in a server, later ones, a look, `doctor --scene`, and the example
`settle` on a mesh. Printed are seconds, processor seconds and memory.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "gateway" / "python" / "tandem"))
RELEASE = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
URL = "http://127.0.0.1:8791/v1/episodes"
#: A task that has room in the middle of the house.
TASK = "table_align"
IMAGE_PX = 1024
SITE = '<mujoco><include file="scene.xml"/><worldbody><site name="task" pos="0 0 0"/></worldbody></mujoco>'


def pot(triangles: int, seed: int) -> trimesh.Trimesh:
    """Returns a closed surface around z with a bumpy outside and a hollow, on z = 0, with texture coordinates."""
    random = np.random.default_rng(seed)
    around = int(np.sqrt(triangles))
    along = triangles // (2 * around)
    angle, height = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, 1, along + 1))
    # The profile goes up the outside and down the inside.
    radius = 0.12 * np.sin(np.pi * height) ** 0.5 * (1 + 0.03 * random.standard_normal((along + 1, around + 1)))
    radius[:, -1] = radius[:, 0]
    up = 0.25 * np.minimum(height / 0.6, 1.0) - 0.2 * np.maximum(height - 0.6, 0.0) / 0.4
    corners = np.stack([radius * np.cos(angle), radius * np.sin(angle), up], axis=-1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    first = row * (around + 1) + column
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + around + 2], axis=-1).reshape(-1, 3),
            np.stack([first, first + around + 2, first + around + 1], axis=-1).reshape(-1, 3),
        ]
    )
    made = trimesh.Trimesh(corners, faces, process=False)
    uv = np.stack([angle / (2 * np.pi), height], axis=-1).reshape(-1, 2)
    pixels = random.integers(0, 255, (IMAGE_PX // 32, IMAGE_PX // 32, 3)).astype(np.uint8)
    image = Image.fromarray(pixels).resize((IMAGE_PX, IMAGE_PX), Image.Resampling.BICUBIC)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image, roughnessFactor=0.8)
    made.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return made


def write_asset(folder: Path, name: str, triangles: int, seed: int, pieces: int = 12) -> None:
    """Writes a model with a drawn mesh and convex pieces, which are hulls of sectors."""
    folder.mkdir(parents=True, exist_ok=True)
    made = pot(triangles, seed)
    sector = np.floor((np.arctan2(made.vertices[:, 1], made.vertices[:, 0]) + np.pi) / (2 * np.pi) * pieces).clip(0, pieces - 1)
    collisions = ""
    for piece in range(pieces):
        trimesh.convex.convex_hull(made.vertices[sector == piece]).export(folder / f"{name}_{piece}.obj")
        collisions += (
            f'<collision name="c{piece}"><geometry><mesh><uri>{name}_{piece}.obj</uri></mesh></geometry>'
            "<surface><friction><ode><mu>0.5</mu></ode></friction></surface></collision>"
        )
    made.apply_transform([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    made.export(folder / f"{name}.gltf")
    visual = f'<visual name="v"><geometry><mesh><uri>{name}.gltf</uri></mesh></geometry></visual>'
    inertia = "".join(f"<{axis}>0.01</{axis}>" for axis in ("ixx", "iyy", "izz"))
    inertial = f"<inertial><mass>1</mass><pose>0 0 0.1 0 0 0</pose><inertia>{inertia}</inertia></inertial>"
    link = f'<link name="base_link">{inertial}{visual}{collisions}</link>'
    (folder / f"{name}.sdf").write_text(f'<sdf version="1.7"><model name="{name}">{link}</model></sdf>')


def write_house(folder: Path, objects: int, triangles: int, kinds: int = 6) -> Path:
    """Writes a house of one large room with objects along its walls, and returns its directives."""
    for kind in range(kinds):
        write_asset(folder / "assets" / f"pot_{kind}", f"pot_{kind}", triangles // kinds, kind)
    shapes = ""
    for name, size, place in [
        ("floor", "12 12 0.1", "0 0 -0.05"),
        *((f"wall_{x}", "0.1 12 2.5", f"{x} 0 1.25") for x in (-6, 6)),
        *((f"side_{y}", "12 0.1 2.5", f"0 {y} 1.25") for y in (-6, 6)),
    ]:
        both = f"<pose>{place} 0 0 0</pose><geometry><box><size>{size}</size></box></geometry>"
        shapes += f'<visual name="{name}">{both}</visual><collision name="{name}">{both}</collision>'
    room = f'<sdf version="1.7"><model name="room"><link name="body">{shapes}</link></model></sdf>'
    (folder / "assets" / "room.sdf").write_text(room)
    (folder / "package.xml").write_text("<package><name>scene</name></package>")
    directives = "directives:\n- add_model: {name: room, file: package://scene/assets/room.sdf}\n"
    directives += '- add_weld: {parent: world, child: "room::body"}\n'
    for number in range(objects):
        angle = 2 * np.pi * number / objects
        place = [float(5 * np.cos(angle)), float(5 * np.sin(angle)), 0.001]
        file = f"package://scene/assets/pot_{number % kinds}/pot_{number % kinds}.sdf"
        pose = f"default_free_body_pose: {{base_link: {{translation: {place}}}}}"
        directives += f"- add_model: {{name: pot_{number}, file: '{file}', {pose}}}\n"
    house = folder / "house.dmd.yaml"
    house.write_text(directives)
    return house


def timed(command: list[Any]) -> tuple[str, str]:
    """Runs a program, and returns its output and its cost."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.time()
    done = subprocess.run([str(word) for word in command], check=False, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.stdout + done.stderr, f"{time.time() - begin:.2f} s, {cpu_s:.2f} s of processors"


def call(path: str, method: str, body: Any = None) -> Any:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(URL + path, data, {"content-type": "application/json"}, method=method)
    return json.loads(urllib.request.urlopen(request, timeout=300).read() or b"{}")


def starts(scene: Path, runs: Path) -> None:
    """Starts episodes one after another in one server."""
    command = [RELEASE / "tandem", "serve", "--listen", "127.0.0.1:8791", "--scene", scene, "--runs", runs]
    server = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def costs(do: Any) -> tuple[Any, str]:
        def cpu_s() -> float:
            words = Path(f"/proc/{server.pid}/stat").read_text().rsplit(")", 1)[1].split()
            return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

        before, begin = cpu_s(), time.time()
        found = do()
        return found, f"{time.time() - begin:.2f} s, {cpu_s() - before:.2f} s of processors"

    try:
        while True:
            try:
                call("", "GET")
                break
            except (urllib.error.URLError, ConnectionError):
                time.sleep(0.1)
        for number in range(3):
            found, cost = costs(lambda seed=number: call("", "POST", {"task": TASK, "seed": seed}))
            episode = f"/{found['episode_id']}"
            _, look = costs(lambda at=episode: call(f"{at}/tools/observe", "POST", {}))
            call(episode, "DELETE")
            resident_mb = int(Path(f"/proc/{server.pid}/statm").read_text().split()[1]) * resource.getpagesize() / 1e6
            print(f"start {number + 1}: {cost}; first look: {look}; {resident_mb:.0f} MB")
    finally:
        server.terminate()
        server.wait()


def million(folder: Path, triangles: int) -> None:
    """Loads one mesh, draws it and simulates a second."""
    (folder / "mesh").mkdir(exist_ok=True)
    pot(triangles, 9).export(folder / "mesh" / "pot.obj")
    scene = folder / "mesh" / "scene.xml"
    asset = '<asset><mesh name="pot" file="pot.obj"/></asset>'
    geom = '<geom type="mesh" mesh="pot" contype="0" conaffinity="0"/>'
    scene.write_text(f'<mujoco>{asset}<worldbody><geom type="plane" size="5 5 1"/>{geom}</worldbody></mujoco>')
    found, cost = timed([RELEASE / "examples" / "settle", scene])
    # It is the first program that this one starts.
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1000
    print(f"a mesh of {json.loads(found)['triangles']} triangles: {cost}; at most {peak_mb:.0f} MB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--objects", type=int, default=50)
    parser.add_argument("--triangles", type=int, default=250_000)
    parser.add_argument("--mesh", type=int, default=1_000_000)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    million(given.out, given.mesh)

    from importing import import_file

    house = write_house(given.out, given.objects, given.triangles)
    begin = time.time()
    report = import_file(house, given.out / "imported")
    print(f"import of {report.triangles} triangles: {time.time() - begin:.1f} s")
    scene = given.out / "imported" / "room.xml"
    scene.write_text(SITE)
    starts(scene, given.out / "runs")
    _, cost = timed([RELEASE / "tandem", "doctor", "--scene", scene])
    print(f"doctor --scene: {cost}")


if __name__ == "__main__":
    main()
