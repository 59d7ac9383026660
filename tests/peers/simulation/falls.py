"""A single robot on a floor with random commands: our physics, and MuJoCo's under the same commands.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install -r tests/peers/simulation/falls.txt
    cargo build --release
    /tmp/peers/bin/python tests/peers/simulation/falls.py --episodes 20

Joint targets are drawn by `tandem bench falls --cases alone_on_floor` for all joints, legs included, by which nothing
balances; MuJoCo gets them with the same gains, limits, step of 5 ms and integrator as the robot's file says. Ours adds
what its arms weigh, keeps to the speeds of the motors, and lets the legs of a fallen robot go limp; MuJoCo does none of
these. Both are held to the same measures; the book's page of figures has the equation of energy. Here u is the mean of the
velocities before and after a step, c the Coriolis forces:
  made = K(q', v') - K(q, v') - dt c . u + U(q') - U(q) + W_gravity,   and what constraints put in, if they do in sum.
"""

import argparse
import json
import os
import subprocess
import tempfile
from collections import defaultdict, deque
from pathlib import Path

import mujoco
import numpy as np

REPOSITORY = Path(__file__).resolve().parents[3]
ASSETS = REPOSITORY / "sim/assets"
TANDEM = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")) / "release/tandem"

DT_S = 0.005
SUBSTEPS = 4
WINDOW_STEPS = 40
MIN_SCALE_J = 100.0
DEEP_M = 0.02
GUARDS = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]


def floor_with_robot():
    scene = mujoco.MjSpec.from_file(str(ASSETS / "scenes/floor.xml"))
    scene.option.timestep = DT_S
    scene.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    robot = mujoco.MjSpec.from_file(str(ASSETS / "robots/g1_dex3/robot.xml"))
    scene.attach(robot, prefix="A_", frame=scene.worldbody.add_frame())
    return scene.compile()


class Energy:
    """Quantities of a state, computed with separate data."""

    def __init__(self, model):
        self.model, self.data = model, mujoco.MjData(model)
        self.mass = np.zeros((model.nv, model.nv))

    def look(self, qpos, qvel):
        """Mass matrix, forces of gravity, Coriolis forces, potential energy."""
        model, data = self.model, self.data
        data.qpos[:], data.qvel[:] = qpos, 0.0
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        gravity = -data.qfrc_bias.copy()
        data.qvel[:] = qvel
        mujoco.mj_fwdVelocity(model, data)
        coriolis = data.qfrc_bias + gravity
        mujoco.mj_fullM(model, data, self.mass)
        potential = -(model.body_mass @ data.xipos @ model.opt.gravity)
        return self.mass.copy(), gravity, coriolis, potential


class Greatest:
    def __init__(self):
        self.speed_m_s = self.made_j = self.made_share = self.depth_m = self.deep_s = self.beyond_rad = 0.0
        self.resets = 0


def play(model, targets_rad):
    data, energy, seen = mujoco.MjData(model), Energy(model), Greatest()
    mujoco.mj_resetDataKeyframe(model, data, model.key("A_stand").id)
    joints = model.actuator_trnid[:, 0]
    dofs, places = model.jnt_dofadr[joints], model.jnt_qposadr[joints]
    kp, kv = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    limit = model.actuator_forcerange[:, 1]
    last = data.qpos[places].copy()
    window, deep = deque(maxlen=WINDOW_STEPS), defaultdict(int)
    for row in np.array(targets_rad):
        for substep in range(1, SUBSTEPS + 1):
            data.ctrl[:] = last + (row - last) * substep / SUBSTEPS + kv / kp * (row - last) / (SUBSTEPS * DT_S)
            before, v = data.qpos.copy(), data.qvel.copy()
            mujoco.mj_step(model, data)
            resets = sum(data.warning[guard].number for guard in GUARDS)
            if resets > seen.resets:
                # The guard has put the robot back: nothing can be compared across that.
                seen.resets = resets
                window.clear()
                deep.clear()
                continue
            window.append(balance(model, data, energy, before, v, dofs, kp, kv, limit, places))
            look(model, data, seen, window, deep, joints, places)
        last = row
    return seen


def balance(model, data, energy, before, v, dofs, kp, kv, limit, places):
    """Energies of one step, J: initial kinetic energy, energy put in, removed and created."""
    after = data.qvel
    mass, gravity, coriolis, potential = energy.look(before, v)
    mass_now, _, _, potential_now = energy.look(data.qpos, after)
    kinetic = lambda mass, v: 0.5 * v @ mass @ v
    mean = 0.5 * (v + after)
    weights = DT_S * gravity @ mean
    # The drives' dampers are implicit in the step.
    efforts = np.clip(kp * (data.ctrl - before[places]) - kv * after[dofs], -limit, limit)
    drives = DT_S * efforts * mean[dofs]
    whole = kinetic(mass, after) - kinetic(mass, v) + DT_S * coriolis @ mean
    made = kinetic(mass_now, after) - kinetic(mass, after) - DT_S * coriolis @ mean
    made += potential_now - potential + weights
    return kinetic(mass, v), max(weights, 0.0) + np.maximum(drives, 0.0).sum(), whole - weights - drives.sum(), made


def look(model, data, seen, window, deep, joints, places):
    velocity = np.zeros(6)
    for body in range(1, model.nbody):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
        seen.speed_m_s = max(seen.speed_m_s, np.linalg.norm(velocity[3:]))
    _, put_in, taken, made = np.sum(window, axis=0)
    made_j = made + max(taken, 0.0)
    seen.made_j = max(seen.made_j, made_j)
    seen.made_share = max(seen.made_share, made_j / max(window[0][0] + put_in, MIN_SCALE_J))
    depths = defaultdict(float)
    for contact in data.contact:
        pair = tuple(contact.geom)
        depths[pair] = max(depths[pair], -contact.dist)
    for pair in [pair for pair in deep if depths[pair] <= DEEP_M]:
        del deep[pair]
    for pair, depth_m in depths.items():
        seen.depth_m = max(seen.depth_m, depth_m)
        if depth_m > DEEP_M:
            deep[pair] += 1
            seen.deep_s = max(seen.deep_s, deep[pair] * DT_S)
    low, high = model.jnt_range[joints].T
    q = data.qpos[places]
    seen.beyond_rad = max(seen.beyond_rad, (low - q).max(), (q - high).max())


def commands(episodes):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "commands.json"
        words = ["bench", "falls", "--cases", "alone_on_floor", "--episodes", str(episodes), "--commands", str(path)]
        subprocess.run([TANDEM, *words], check=True)
        return json.loads(path.read_text())


def line(name, speed, made, share, depth, deep, beyond, failed):
    print(f"{name:24}{speed:8.1f} m/s{made:10.1f} J{share:9.1%}{depth * 1e3:7.0f} mm{deep:7.2f} s"
          f"{beyond:8.2f} rad{failed:>16}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--commands", type=Path, help="a file that `tandem bench falls --commands FILE` wrote")
    arguments = parser.parse_args()
    if arguments.commands:
        told = json.loads(arguments.commands.read_text())
    else:
        told = commands(arguments.episodes)
    model = floor_with_robot()
    print(f"{'':24}{'fastest link':>12}{'energy made':>21}{'overlap':>10}{'> 2 cm':>9}{'beyond':>12}")
    ours, theirs = [], []
    for trial, episode in told:
        extremes = {name: greatest["value"] for name, greatest in trial["extremes"].items()}
        diverged = trial["diverged"] is not None
        names = ["speed_m_s", "made_j", "made_share", "depth_m", "deep_s", "beyond_rad"]
        ours.append([*(extremes[name] for name in names), float(diverged)])
        line(f"seed {episode['seed']} ours", *ours[-1][:-1], "diverged" if diverged else "")
        seen = play(model, episode["targets_rad"])
        theirs.append([*(getattr(seen, name) for name in names), float(seen.resets > 0)])
        line("          MuJoCo", *theirs[-1][:-1], f"{seen.resets} resets" if seen.resets else "")
    for name, all_of in [("ours", ours), ("MuJoCo", theirs)]:
        failed = int(np.array(all_of)[:, -1].sum())
        line(f"{name}, greatest of {len(told)}", *np.max(all_of, axis=0)[:-1], f"{failed} not finite")


if __name__ == "__main__":
    main()
