"""Inverse kinematics against Pink and mink, and forward kinematics against MuJoCo, in one run on this machine.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install -r tests/peers/numerics/ik.txt
    cargo build --release -p tandem-ik --examples
    /tmp/peers/bin/python tests/peers/numerics/ik.py

Same robot file, same 200 pairs of wrist poses, same costs, limits, time step and tolerances for all. Prints a table,
and fails if Pink's iteration counts are not the recorded ones, which `cargo test -p tandem-ik` holds ours against, if
we are not 12 times faster, or if a link is not where MuJoCo puts it. CARGO_TARGET_DIR is respected.
"""

import json
import logging
import os
import subprocess
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

import mink
import mujoco
import numpy as np
import pinocchio as pin
import pink

REPOSITORY = Path(__file__).resolve().parents[3]
DATA = REPOSITORY / "ik/tests/data"
URDF = DATA / "g1_upper_body.urdf"
ROBOT = REPOSITORY / "sim/assets/robots/g1_dex3/robot.xml"
EXAMPLES = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")) / "release/examples"

DT_S = 0.02
POSITION_TOLERANCE_M = 1e-3
ORIENTATION_TOLERANCE_RAD = np.deg2rad(0.5)
MAX_ITERATIONS = 300
POSTURE_COST = 1e-3
DAMPING_COST = {"default": 0.0, "tuned": 1e-2}
SOLVER = "quadprog"
MIN_SPEEDUP = 12.0
POSE_TOLERANCE = 1e-6


def measure(targets, start, errors, step):
    """Runs one stack: `start(target)` sets up, `errors()` gives (m, rad) per frame, `step()` moves once."""
    iterations, step_us, solve_ms = [], [], []
    for target in targets:
        start(target)
        reached = None
        begin = time.perf_counter()
        for iteration in range(MAX_ITERATIONS + 1):
            if all(p <= POSITION_TOLERANCE_M and r <= ORIENTATION_TOLERANCE_RAD for p, r in errors()):
                reached = iteration
                break
            if iteration < MAX_ITERATIONS:
                before = time.perf_counter()
                step()
                step_us.append((time.perf_counter() - before) * 1e6)
        if reached is not None:
            solve_ms.append((time.perf_counter() - begin) * 1e3)
        iterations.append(reached)
    needed = [count for count in iterations if count is not None]
    return {
        "reached": len(needed) / len(targets),
        "iterations_median": float(np.median(needed)),
        "step_us_median": float(np.median(step_us)),
        "solve_ms_median": float(np.median(solve_ms)),
        "iterations": iterations,
    }


def run_pink(data, damping_cost):
    model = pin.buildModelFromUrdf(str(URDF))
    assert list(model.names)[1:] == data["free_joints"]
    scratch = model.createData()
    q_start = np.array(data["start_q_rad"])
    frames = data["frames"]
    ids = [model.getFrameId(frame) for frame in frames]
    frame_tasks = [pink.tasks.FrameTask(frame, 1.0, 1.0) for frame in frames]
    posture = pink.tasks.PostureTask(cost=POSTURE_COST)
    posture.set_target(q_start)
    tasks = [*frame_tasks, posture]
    if damping_cost > 0.0:
        tasks.append(pink.tasks.DampingTask(cost=damping_cost))
    limits = [pink.limits.ConfigurationLimit(model, 0.5), pink.limits.VelocityLimit(model)]
    state = {}

    def start(target):
        state["goals"] = []
        for task, frame in zip(frame_tasks, frames):
            pose = target["frames"][frame]
            w, x, y, z = pose["quaternion_wxyz"]
            goal = pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(pose["position_m"]))
            task.set_target(goal)
            state["goals"].append(goal)
        state["configuration"] = pink.Configuration(model, scratch, q_start.copy())

    def errors():
        for goal, frame in zip(state["goals"], ids):
            missing = goal.actInv(state["configuration"].data.oMf[frame])
            yield np.linalg.norm(missing.translation), np.linalg.norm(pin.log3(missing.rotation))

    def step():
        velocity = pink.solve_ik(
            state["configuration"], tasks, DT_S, solver=SOLVER, damping=1e-12, limits=limits
        )
        state["configuration"].integrate_inplace(velocity, DT_S)

    return measure(data["targets"], start, errors, step)


def run_mink(data, damping_cost):
    text = URDF.read_text()
    # MuJoCo merges nothing and wants inertia, which kinematics does not need.
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    for link in ["pelvis", *(joint.replace("_joint", "_link") for joint in data["free_joints"]), "torso_link"]:
        text = text.replace(f'<link name="{link}"/>', f'<link name="{link}">{inertial}</link>')
    model = mujoco.MjModel.from_xml_string(text)
    names = [model.joint(joint).name for joint in range(model.njnt)]
    assert names == data["free_joints"]
    q_start = np.array(data["start_q_rad"])
    frames = data["frames"]
    frame_tasks = [mink.FrameTask(frame, "body", 1.0, 1.0) for frame in frames]
    posture = mink.PostureTask(model, cost=POSTURE_COST)
    posture.set_target(q_start)
    tasks = [*frame_tasks, posture]
    if damping_cost > 0.0:
        tasks.append(mink.DampingTask(model, cost=damping_cost))
    speeds = {name: np.array([data["limits"][name]["velocity"]]) for name in names}
    limits = [mink.ConfigurationLimit(model, gain=0.5), mink.VelocityLimit(model, speeds)]
    state = {}

    def start(target):
        state["goals"] = []
        for task, frame in zip(frame_tasks, frames):
            pose = target["frames"][frame]
            rotation = mink.SO3(np.array(pose["quaternion_wxyz"]))
            goal = mink.SE3.from_rotation_and_translation(rotation, np.array(pose["position_m"]))
            task.set_target(goal)
            state["goals"].append(goal)
        state["configuration"] = mink.Configuration(model)
        state["configuration"].update(q_start.copy())

    def errors():
        for goal, frame in zip(state["goals"], frames):
            missing = goal.inverse() @ state["configuration"].get_transform_frame_to_world(frame, "body")
            yield np.linalg.norm(missing.translation()), np.linalg.norm(missing.rotation().log())

    def step():
        velocity = mink.solve_ik(state["configuration"], tasks, DT_S, SOLVER, damping=1e-12, limits=limits)
        state["configuration"].integrate_inplace(velocity, DT_S)

    return measure(data["targets"], start, errors, step)


def run_ours():
    command = [EXAMPLES / "bench", URDF, DATA / "wrist_targets.json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return {entry.pop("name"): entry for entry in report["configurations"]}


def worst_pose_error():
    """Largest difference (m, or of a unit quaternion) of any link, site or the centre of mass from MuJoCo's."""
    model = mujoco.MjModel.from_xml_path(str(ROBOT))
    data = mujoco.MjData(model)
    process = subprocess.Popen(
        [EXAMPLES / "link_poses", ROBOT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    names = json.loads(process.stdout.readline())
    addresses = [model.joint(name).qposadr[0] for name in names]
    random = np.random.default_rng(1)
    differences = []
    for _ in range(50):
        ranges = np.array([model.joint(name).range for name in names])
        q = random.uniform(ranges[:, 0], ranges[:, 1])
        data.qpos[:] = 0.0
        data.qpos[3] = 1.0
        data.qpos[addresses] = q
        mujoco.mj_forward(model, data)
        print(json.dumps(q.tolist()), file=process.stdin, flush=True)
        ours = json.loads(process.stdout.readline())
        centre = np.array(ours.pop("center_of_mass"))
        differences.append(np.abs(centre - data.subtree_com[model.body("pelvis").id]).max())
        for name, pose in ours.items():
            is_body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0
            theirs = data.body(name) if is_body else data.site(name)
            quaternion = np.empty(4)
            mujoco.mju_mat2Quat(quaternion, theirs.xmat)
            if quaternion @ pose[3:] < 0.0:
                quaternion = -quaternion
            differences += [np.abs(theirs.xpos - pose[:3]).max(), np.abs(quaternion - pose[3:]).max()]
    process.stdin.close()
    process.wait()
    # `max` of NumPy, unlike Python's, does not overlook numbers that are not.
    return np.max(differences), len(differences)


def main():
    logging.disable(logging.WARNING)
    warnings.filterwarnings("ignore")
    data = json.loads((DATA / "wrist_targets.json").read_text())
    ours = run_ours()
    rows, failures = [], []
    for name, damping_cost in DAMPING_COST.items():
        pinks = run_pink(data, damping_cost)
        rows.append((f"Pink {version('pin-pink')} + {SOLVER}, {name}", pinks))
        rows.append((f"mink {version('mink')} + {SOLVER}, {name}", run_mink(data, damping_cost)))
        rows.append((f"tandem-ik, {name}", ours[name]))
        expected = [target["pink_iterations"][name] for target in data["targets"]]
        different = sum(recorded != now for recorded, now in zip(expected, pinks["iterations"]))
        speedup = pinks["solve_ms_median"] / ours[name]["solve_ms_median"]
        if different:
            failures.append(f"{name}: Pink needs other numbers of iterations than recorded on {different} targets")
        print(f"{name}: tandem-ik solves {speedup:.1f} times faster than Pink")
        if speedup < MIN_SPEEDUP:
            failures.append(f"{name}: {speedup:.1f} times faster than Pink, {MIN_SPEEDUP} expected")
        if abs(pinks["reached"] - ours[name]["reached"]) > 1e-9:
            failures.append(f"{name}: Pink reaches {pinks['reached']}, tandem-ik {ours[name]['reached']}")
    rows += [(f"tandem-ik, {name}", entry) for name, entry in ours.items() if name not in DAMPING_COST]

    print(f"\n{'':44}{'reached':>9}{'iterations':>12}{'us/step':>10}{'ms/solve':>10}")
    for name, row in rows:
        print(
            f"{name:44}{row['reached']:9.3f}{row['iterations_median']:12.0f}"
            f"{row['step_us_median']:10.1f}{row['solve_ms_median']:10.3f}"
        )
    worst, compared = worst_pose_error()
    print(f"\nlargest difference from MuJoCo {mujoco.__version__} over {compared} positions and orientations: {worst:.1e}")
    if not worst <= POSE_TOLERANCE:
        failures.append(f"forward kinematics differs from MuJoCo's by {worst:.1e}")
    for failure in failures:
        print(f"FAILED {failure}", file=sys.stderr)
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
