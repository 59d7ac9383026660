"""Steps of environments per second, compared with MuJoCo's own binding, its `rollout` and EnvPool, all in the same minutes.

    pip install -r tests/peers/environments/speed.txt
    pip install ./gateway/python
    python tests/peers/environments/speed.py [--json speed.json]

A step is 20 ms: four physics steps of 5 ms. Tandem's robots stand by their controller, estimate their motion, and are scored;
MuJoCo steps the same files, with robots on fixed position targets and nothing around it. EnvPool's Humanoid is another and much
smaller robot, for scale. Every round measures all of them one after the other; figures are medians over rounds. On a machine
that others use, too, steps per second of processor time, of all threads together, are what can be compared; what threads win is
measured on a quiet one.
"""

import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import envpool
import mujoco
import mujoco.rollout
import numpy as np

from gym_tandem import TandemVectorEnv

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "simulation"))
from physics_timing import Kitchen  # noqa: E402

ROUNDS = 5
WORLDS = 8
SUBSTEPS = 4
STEPS = 75
SETTLING_STEPS = 25
HUMANOID_STEPS = 2000


def per_second(steps, run):
    """Steps per second, and per second of processor time."""
    begin, busy = time.perf_counter(), time.process_time()
    run()
    return steps / (time.perf_counter() - begin), steps / (time.process_time() - busy)


class Tandem:
    """A batch of environments without pictures whose robots stand."""

    def __init__(self, task, robots, threads):
        self.envs = TandemVectorEnv(task, WORLDS, threads=threads, obs_type="state", copy=False)
        rows = np.zeros((WORLDS, robots, 35), np.float32)
        rows[:, :, -1] = 0.74
        self.rows = rows.reshape(WORLDS, -1)

    def run(self, steps):
        for _ in range(steps):
            self.envs.step(self.rows)

    def measure(self):
        self.envs.reset(seed=2000)
        self.run(SETTLING_STEPS)
        return per_second(STEPS * WORLDS, lambda: self.run(STEPS))


class Binding:
    """MuJoCo stepped from Python, world after world on one thread."""

    def __init__(self, robots):
        self.kitchens = [Kitchen(robots, held=False) for _ in range(WORLDS)]

    def run(self, steps):
        for _ in range(steps):
            for kitchen in self.kitchens:
                mujoco.mj_step(kitchen.model, kitchen.data, SUBSTEPS)

    def measure(self):
        for kitchen in self.kitchens:
            kitchen.reset()
        # Robots on position targets topple slowly: they are put back before that begins.
        steps = STEPS // 2
        self.run(SETTLING_STEPS // 2)
        rate = per_second(steps * WORLDS, lambda: self.run(steps))
        for kitchen in self.kitchens:
            kitchen.check()
        return rate


class Rollout:
    """MuJoCo's own threads, without Python between steps."""

    def __init__(self, robots, threads):
        self.kitchen = Kitchen(robots, held=False)
        self.threads = threads
        self.data = [mujoco.MjData(self.kitchen.model) for _ in range(threads)]

    def measure(self):
        model = self.kitchen.model
        self.kitchen.reset()
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state = np.zeros(size)
        mujoco.mj_getState(model, self.kitchen.data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        steps = STEPS // 2 * SUBSTEPS
        control = np.tile(self.kitchen.rest_ctrl, (WORLDS, steps, 1))
        states = np.tile(state, (WORLDS, 1))
        with mujoco.rollout.Rollout(nthread=self.threads if self.threads > 1 else 0) as rollout:
            return per_second(steps // SUBSTEPS * WORLDS, lambda: rollout.rollout(model, self.data, states, control))


class Humanoid:
    """EnvPool's Humanoid, a step of which is 15 ms of a robot with 17 motors."""

    def __init__(self, threads):
        self.envs = envpool.make_gymnasium("Humanoid-v4", num_envs=WORLDS, num_threads=threads)
        self.actions = np.zeros((WORLDS, *self.envs.action_space.shape))

    def measure(self):
        self.envs.reset()

        def run():
            for _ in range(HUMANOID_STEPS // WORLDS):
                self.envs.step(self.actions)

        return per_second(HUMANOID_STEPS, run)


CASES = {
    "Tandem, 2 robots, 1 thread": lambda: Tandem("handover", 2, 1),
    "Tandem, 2 robots, 2 threads": lambda: Tandem("handover", 2, 2),
    "MuJoCo binding, 2 robots": lambda: Binding(2),
    "MuJoCo rollout, 2 robots, 1 thread": lambda: Rollout(2, 1),
    "MuJoCo rollout, 2 robots, 2 threads": lambda: Rollout(2, 2),
    "Tandem, 3 robots, 2 threads": lambda: Tandem("big_table", 3, 2),
    "MuJoCo rollout, 3 robots, 2 threads": lambda: Rollout(3, 2),
    "EnvPool Humanoid-v4, 2 threads": lambda: Humanoid(2),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    cases = {name: make() for name, make in CASES.items()}
    rounds = [{name: case.measure() for name, case in cases.items()} for _ in range(ROUNDS)]
    print(f"MuJoCo {mujoco.__version__}, EnvPool {envpool.__version__}; {WORLDS} worlds, medians of {ROUNDS} rounds\n")
    print(f"{'':38}{'steps/s':>9}{'per s of processor':>20}")
    report = {}
    for name in cases:
        rate, busy = (statistics.median(measured[name][figure] for measured in rounds) for figure in range(2))
        report[name] = {"steps_per_s": round(rate), "steps_per_processor_s": round(busy)}
        print(f"{name:38}{rate:9.0f}{busy:20.0f}")
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
