"""Time of a 5 ms step of one to three of our robots in the kitchen: MuJoCo's, and ours from `tandem bench physics`.

Both read the same files and run on one thread, one after the other. MuJoCo cannot run our walking controller; what it
steps instead is said beside each case.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np

REPOSITORY = Path(__file__).resolve().parents[3]
ASSETS = REPOSITORY / "sim/assets"
TANDEM = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")) / "release/tandem"

DT_S = 0.005
# x, y in m and heading in rad: Handover's places, and a third robot that stands free.
PLACES = [(0.0, 0.0, 0.0), (0.74, -0.12, np.pi), (-0.9, -1.2, 0.5)]
SETTLING_STEPS = 50
# A robot on position targets topples slowly; it is put back before that begins.
STEPS_PER_ROUND = 150
ROUNDS = 10
WAVE_HZ, WAVE_RAD = 0.5, 0.4
FALLEN_HEIGHT_M = 0.7
LARGEST_RATIO = 0.7
# MuJoCo is timed before and after us; a machine on which the two differ by more is not quiet enough to compare on.
QUIET_RATIO = 1.15

# Fingers round an upright cylinder of 7 cm; the left hand mirrors the right.
CLOSED_RIGHT_HAND = {"thumb_1": 0.75, "thumb_2": -0.8, "middle_0": 1.1, "middle_1": 1.3, "index_0": 1.1, "index_1": 1.3}
# Middle of the grasped cylinder in the frame of the right wrist's site, and how far above its base a bottle is held.
GRASP_IN_WRIST_M = (0.12, 0.055, 0.0)
BOTTLE_HELD_AT_M = 0.1

CASES = {
    "standing": "both stand; ours balances, MuJoCo's robot has fixed position targets",
    "walking": "ours walks; MuJoCo's robot stands on fixed targets and waves its arms",
    "held object": "each robot holds a bottle of 0.5 kg in its right hand",
}


class Kitchen:
    """The kitchen of Handover with robots, in MuJoCo. Every robot has its bottle; if no robot holds it, it stands on the island."""

    def __init__(self, robots, held):
        self.robots = robots
        self.held = held
        scene = mujoco.MjSpec.from_file(str(ASSETS / "scenes/kitchen_084.xml"))
        # What the robot's own file asks for; attaching keeps the scene's options.
        scene.option.timestep = DT_S
        scene.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        robot_file = ASSETS / "robots/g1_dex3/robot.xml"
        for index, (x, y, yaw) in enumerate(PLACES[:robots]):
            frame = scene.worldbody.add_frame(pos=[x, y, 0.0], quat=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
            scene.attach(mujoco.MjSpec.from_file(str(robot_file)), prefix=f"{index}_", frame=frame)
        for index in range(robots if held else 1):
            frame = scene.worldbody.add_frame(pos=[0.37, 0.2, 0.8])
            bottle = mujoco.MjSpec.from_file(str(ASSETS / "objects/bottle.xml"))
            scene.attach(bottle, prefix=f"{index}_", frame=frame)
        self.model = scene.compile()
        self.data = mujoco.MjData(self.model)
        alone = mujoco.MjModel.from_xml_path(str(robot_file))
        self.rest_rad = alone.key("stand").qpos[7:]
        self.pelvis_height_m = alone.key("stand").qpos[2]
        self.joints = [alone.joint(joint).name for joint in range(1, alone.njnt)]
        self.reset()

    def reset(self):
        mujoco.mj_resetData(self.model, self.data)
        targets = dict(zip(self.joints, self.rest_rad))
        for robot in range(self.robots):
            pose = targets.copy()
            if self.held:
                pose |= {f"right_hand_{joint}_joint": angle for joint, angle in CLOSED_RIGHT_HAND.items()}
            for joint in self.joints:
                # The fingers start where they touch the bottle: nearly closed.
                start = targets[joint] + 0.8 * (pose[joint] - targets[joint])
                self.data.joint(f"{robot}_{joint}").qpos[0] = start
                self.data.actuator(f"{robot}_{joint}").ctrl[0] = pose[joint]
        mujoco.mj_forward(self.model, self.data)
        if self.held:
            for robot in range(self.robots):
                self.put_bottle_in_hand(robot)
        self.rest_ctrl = self.data.ctrl.copy()
        mujoco.mj_forward(self.model, self.data)

    def put_bottle_in_hand(self, robot):
        wrist = self.data.site(f"{robot}_right_wrist")
        rotation = wrist.xmat.reshape(3, 3)
        centre = wrist.xpos + rotation @ GRASP_IN_WRIST_M
        bottle = self.data.joint(f"{robot}_bottle")
        bottle.qpos[:3] = centre - BOTTLE_HELD_AT_M * rotation[:, 2]
        mujoco.mju_mat2Quat(bottle.qpos[3:], wrist.xmat)

    def wave(self, step):
        offset = WAVE_RAD * np.sin(2.0 * np.pi * WAVE_HZ * step * DT_S)
        self.data.ctrl[:] = self.rest_ctrl
        for robot in range(self.robots):
            for side, sign in (("left", 1.0), ("right", -1.0)):
                actuator = self.model.actuator(f"{robot}_{side}_shoulder_pitch_joint").id
                self.data.ctrl[actuator] += sign * offset

    def check(self):
        """Checks that no robot fell and no object was dropped. Otherwise the time is that of another situation."""
        for robot in range(self.robots):
            height = self.data.body(f"{robot}_pelvis").xpos[2]
            assert height > FALLEN_HEIGHT_M, f"robot {robot} fell: pelvis at {height:.2f} m"
            if self.held:
                wrist = self.data.site(f"{robot}_right_wrist")
                bottle = self.data.body(f"{robot}_bottle")
                centre = bottle.xpos + BOTTLE_HELD_AT_M * bottle.xmat.reshape(3, 3)[:, 2]
                away = np.linalg.norm(centre - wrist.xpos)
                assert away < 0.2, f"robot {robot} dropped its bottle, now {away:.2f} m from its wrist"


def step_us_median(kitchen, waving):
    spans_us = []
    for _ in range(ROUNDS):
        kitchen.reset()
        for step in range(SETTLING_STEPS + STEPS_PER_ROUND):
            if waving:
                kitchen.wave(step)
            begin = time.perf_counter()
            mujoco.mj_step(kitchen.model, kitchen.data)
            if step >= SETTLING_STEPS:
                spans_us.append((time.perf_counter() - begin) * 1e6)
        kitchen.check()
    return float(np.median(spans_us))


def theirs():
    cases = []
    for name in CASES:
        for robots in range(1, len(PLACES) + 1):
            step_us = step_us_median(Kitchen(robots, held=name == "held object"), waving=name == "walking")
            cases.append({"name": name, "robots": robots, "step_us_median": round(step_us, 1),
                          "realtime_factor": round(DT_S * 1e6 / step_us, 1)})
    return cases


def ours():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "physics.json"
        subprocess.run([TANDEM, "bench", "physics", "--json", path], check=True, stdout=subprocess.DEVNULL)
        return json.loads(path.read_text())["cases"]


def compare(path):
    """Prints the table, and writes it to `path` if given. Returns whether the published speed is reached."""
    before = theirs()
    tandems = {(case["name"], case["robots"]): case for case in ours()}
    after = theirs()
    mujocos = [min(pair, key=lambda case: case["step_us_median"]) for pair in zip(before, after)]
    unrest = max(max(a, b) / min(a, b) for a, b in
                 ((x["step_us_median"], y["step_us_median"]) for x, y in zip(before, after)))
    print(f"MuJoCo {mujoco.__version__}, one thread each, us per step of {DT_S * 1e3:.0f} ms (median), same files\n")
    print(f"{'case':14}{'robots':>7}{'MuJoCo':>10}{'Tandem':>10}{'ratio':>8}")
    ratios = []
    for case in mujocos:
        tandem = tandems[case["name"], case["robots"]]
        ratio = tandem["step_us_median"] / case["step_us_median"]
        ratios.append({"name": case["name"], "robots": case["robots"], "ratio": round(ratio, 3)})
        times = f"{case['step_us_median']:10.1f}{tandem['step_us_median']:10.1f}{ratio:8.2f}"
        print(f"{case['name']:14}{case['robots']:7}{times}{'' if ratio <= LARGEST_RATIO else '  too slow'}")
    if unrest > QUIET_RATIO:
        print(f"\nThe machine is not quiet: MuJoCo's own times differ by a factor of {unrest:.2f} within this run.")
    print()
    for name, compared in CASES.items():
        print(f"{name}: {compared}")
    if path:
        report = {"mujoco": mujoco.__version__, "compared": CASES, "unrest": round(unrest, 3), "mujoco_cases": mujocos,
                  "tandem_cases": list(tandems.values()), "ratios": ratios}
        path.write_text(json.dumps(report, indent=1) + "\n")
    return all(entry["ratio"] <= LARGEST_RATIO for entry in ratios)
