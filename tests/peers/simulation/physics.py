"""Comparison of our physics with MuJoCo's: the same fourteen scenes, and the time of a step of the same robots.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install -r tests/peers/simulation/physics.txt
    cargo build --release
    /tmp/peers/bin/python tests/peers/simulation/physics.py timing --json physics.json
    /tmp/peers/bin/python tests/peers/simulation/physics.py references

`timing` steps robots in the kitchen on one thread, with MuJoCo and then with `tandem bench physics`, prints the ratios
and fails where we take more than LARGEST_RATIO of MuJoCo's time. CARGO_TARGET_DIR is respected.

`references` rewrites tests/peers/scenes/*.json, against which Rust's tests hold our physics: what the sensors of each
scene file read, in MuJoCo at our time step with its usual soft contacts ("mujoco"), and in MuJoCo at steps of 0.25 ms with
contacts, limits and equalities ten times as stiff ("truth"). Where even that is not what rigid bodies do, the truth is solved
by hand, see physics_by_hand.py. Ours has to stay within `tolerance` of the truth; with `since_s` it is only how far a reading
has moved since then that counts.
In a scene the key `start` is where it begins; every key with a later time sets the actuators from then on.
"""

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import mujoco
import numpy as np

import physics_by_hand
import physics_timing

SCENES = Path(__file__).resolve().parents[1] / "scenes"
TRUTH_DT_S = 0.00025
# Time constant of every soft constraint of the truth; MuJoCo's default is 0.02.
TRUTH_TIME_CONSTANT_S = 0.002
TRUTH_IMPEDANCE = (0.99, 0.999)
TRUTH_FRICTION_TO_NORMAL_IMPEDANCE = 100.0
DECIMALS = 4


@dataclass
class Scene:
    name: str
    seconds: float
    hz: int
    # Per sensor of the file: largest difference from the truth in any component at any time, in the sensor's unit.
    tolerance: dict[str, float]
    compares: str
    # Gives all readings for a model, a duration and a rate, where the truth is not MuJoCo's.
    by_hand: Callable | None = None
    since_s: float = 0.0


ALL = [
    Scene("box_slides", 1.0, 50, {"straight": 0.003, "turning": 0.006, "turning_heading": 0.03},
          "where sliding boxes stop, and how a turning one turns", by_hand=physics_by_hand.box_slides),
    Scene("box_on_slope", 2.0, 50, {"slides": 0.005, "holds": 0.001, "holds_by_slope": 0.001},
          "sliding distance, and holding still below the friction angle; whose friction counts"),
    Scene("ball_on_slope", 2.0, 50, {"rolls": 0.005, "resists": 0.005, "slips": 0.01, "slips_spin": 0.4},
          "rolling, rolling friction, and the spin of a ball that slips"),
    # How deep boxes sink into each other is a matter of softness, MuJoCo's and ours; they have done it by then.
    Scene("stack", 10.0, 5, {"lowest": 0.001, "fourth": 0.002, "highest": 0.003, "highest_tilt": 0.01},
          "that a stack of eight stands and does not creep", since_s=0.4),
    Scene("chain", 3.0, 50, {"tip": 0.01, "hinge_1": 0.015, "hinge_2": 0.015, "hinge_6": 0.03},
          "swing angles over time, a spring, a joint at its limit"),
    Scene("door", 3.0, 50, {"door": 0.05, "lever": 0.03, "bolt": 0.005},
          "a bolt that holds, a coupling that draws it, a door that swings to its stop"),
    Scene("trolley", 3.0, 50, {"trolley": 0.04, "heading": 0.04, "swivel_1": 0.1, "swivel_2": 0.1, "swivel_3": 0.2},
          "how far and where a trolley rolls while its castors swing round"),
    # What robots open and push, from the files that the tasks use: within 5 % of the swing and of the way.
    Scene("lever_door", 4.0, 50, {"hinge": 0.07, "lever": 0.04, "bolt": 0.002},
          "a latch that holds until its lever is down, and how far the door of MoveHouse swings"),
    Scene("service_trolley", 4.0, 50, {"service_trolley": 0.06, "heading": 0.05, "swivel_1": 0.15, "swivel_3": 0.15},
          "how far the trolley of CartService runs out"),
    Scene("ball_in_bowl", 5.0, 50, {"ball": 0.015},
          "amplitude and period of a ball that rolls over edges to its rest"),
    Scene("drawer", 1.5, 50, {"upper": 0.005, "front": 0.005, "inside": 0.006, "lower": 0.02},
          "stopping by the friction of a slide, by an end stop; a welded front, a load that goes along"),
    Scene("top", 4.0, 50, {"top": 0.004, "top_axis": 0.04, "ball_spin": 0.2},
          "precession, and how spinning friction takes a ball's spin"),
    Scene("robot_crouch", 2.0, 50,
          {"pelvis": 0.01, "pelvis_forward": 0.03, "left_knee": 0.02, "left_ankle_pitch": 0.02,
           "waist_pitch": 0.01, "left_elbow": 0.005},
          "how far our robot sinks on position targets, two of its joints at their limits"),
    Scene("arm_pushes_box", 2.0, 50, {"shoulder": 0.02, "elbow": 0.02, "box": 0.015, "box_heading": 0.25},
          "where an arm of limited torque leaves a box that it pushed off its middle, and how far it turned it",
          by_hand=physics_by_hand.arm_pushes_box),
]


def stiffened(model):
    """The same scene with constraints so stiff and steps so short that the remaining softness has no effect."""
    model.opt.timestep = TRUTH_DT_S
    model.opt.impratio = TRUTH_FRICTION_TO_NORMAL_IMPEDANCE
    model.opt.tolerance = 1e-12
    for references in [model.geom_solref, model.jnt_solref, model.dof_solref, model.eq_solref]:
        references[:] = [TRUTH_TIME_CONSTANT_S, 1.0]
    model.geom_solimp[:, :2] = TRUTH_IMPEDANCE
    return model


def readings(model, scene):
    """Sensor readings at the scene's rate, from 0 s to its end: samples x numbers."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    changes = {round(time / model.opt.timestep): key for key, time in enumerate(model.key_time) if time > 0.0}
    every = round(1.0 / (scene.hz * model.opt.timestep))
    samples = []
    for step in range(round(scene.seconds / model.opt.timestep) + 1):
        if step in changes:
            data.ctrl[:] = model.key_ctrl[changes[step]]
        if step % every == 0:
            mujoco.mj_forward(model, data)
            samples.append(data.sensordata.copy())
        mujoco.mj_step(model, data)
    return np.array(samples)


def write_reference(scene):
    path = SCENES / f"{scene.name}.xml"
    model = mujoco.MjModel.from_xml_path(str(path))
    names = [model.sensor(sensor).name for sensor in range(model.nsensor)]
    assert names == list(scene.tolerance), f"{path}: a tolerance for each of {names}, in this order"
    theirs = readings(model, scene)
    if scene.by_hand is None:
        truth = readings(stiffened(mujoco.MjModel.from_xml_path(str(path))), scene)
    else:
        truth = scene.by_hand(model, scene.seconds, scene.hz)
    assert np.isfinite(truth).all() and np.isfinite(theirs).all(), f"{path}: MuJoCo diverged"
    quantities = []
    for sensor, name in enumerate(names):
        columns = slice(model.sensor_adr[sensor], model.sensor_adr[sensor] + model.sensor_dim[sensor])
        off = theirs[:, columns] - truth[:, columns]
        since = round(scene.since_s * scene.hz)
        apart = np.abs((off - off[since] if since else off)[since:]).max()
        print(f"{scene.name:16}{name:18}{scene.tolerance[name]:10.4f}{apart:20.4f}")
        rows = {"truth": truth, "mujoco": theirs}
        # Adding 0.0 makes 0 of -0.
        rows = {kind: (values[:, columns].round(DECIMALS) + 0.0).tolist() for kind, values in rows.items()}
        quantities.append({"name": name, "tolerance": scene.tolerance[name], **rows})
    judge = f"MuJoCo {mujoco.__version__}" if scene.by_hand is None else "Coulomb's law, solved by hand"
    reference = {"scene": path.name, "compares": scene.compares, "judge": judge, "seconds": scene.seconds,
                 "hz": scene.hz, "since_s": scene.since_s, "quantities": quantities, "bodies": masses(model)}
    text = json.dumps(reference, separators=(",", ":"))
    path.with_suffix(".json").write_text(text.replace('{"name"', '\n{"name"') + "\n")


def masses(model):
    """Masses and principal inertias, smallest first, which MuJoCo finds for the bodies that move."""
    bodies = [model.body(body) for body in range(1, model.nbody) if model.body_weldid[body] == body]
    return [{"name": body.name, "mass_kg": round(float(body.mass[0]), 6),
             "inertia_kg_m2": [float(f"{moment:.5g}") for moment in sorted(body.inertia)]} for body in bodies]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    modes = parser.add_subparsers(dest="mode", required=True)
    timing = modes.add_parser("timing", help="time of a step, MuJoCo's and ours")
    timing.add_argument("--json", type=Path, help="where to write both sides' cases and the ratios")
    modes.add_parser("references", help="rewrite the recorded readings of the scenes")
    arguments = parser.parse_args()
    match arguments.mode:
        case "timing":
            sys.exit(not physics_timing.compare(arguments.json))
        case "references":
            print(f"{'scene':16}{'quantity':18}{'tolerance':>10}{'MuJoCo at 5 ms':>20}")
            for scene in ALL:
                write_reference(scene)


if __name__ == "__main__":
    main()
