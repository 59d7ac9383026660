"""A published policy balances a robot by `send_joint_drives`, in its own control loop, here and in MuJoCo.

AGILE's velocity policy for the G1 (NVIDIA, `agile_g1_velocity_e2e.onnx`, from github.com/nvidia-isaac/WBC-AGILE) drives legs
and waist with gains of its own; Unitree's (`deploy/pre_train/g1/motion.pt`, from github.com/unitreerobotics/unitree_rl_gym)
drives the legs. All other joints are held by the gains that LeRobot sends to a G1. Neither file is part of Tandem.

    pip install WHEEL -r tests/peers/whole_body/requirements.txt
    python tests/peers/whole_body/play.py agile_g1_velocity_e2e.onnx
    python tests/peers/whole_body/play.py motion.pt

It prints a table. It fails if a robot falls here, does not stand for 60 s, walks less than 10 m, or turns less than 2.5 rad.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from bodies import Body, MujocoBody, TandemBody, heading_rad, tilt_rad
from policy import STEP_S, State, policy_of

Velocity = tuple[float, float, float]


def standing(_time_s: float, _state: State, _y_m: float) -> Velocity:
    return 0.0, 0.0, 0.0


def walking(_time_s: float, state: State, y_m: float) -> Velocity:
    """0.4 m/s ahead; line and heading are held."""
    return 0.4, max(-0.1, min(0.1, -0.3 * y_m)), max(-0.3, min(0.3, -heading_rad(state.quaternion_wxyz)))


def turning(time_s: float, _state: State, _y_m: float) -> Velocity:
    """0.4 rad/s to the left for 8 s, then standing."""
    return 0.0, 0.0, 0.4 if time_s < 8.0 else 0.0


@dataclass
class Case:
    """Commands and disturbance of a trial."""

    name: str
    seconds: float
    velocity: Callable[[float, State, float], Velocity]
    stress: dict[str, object] = field(default_factory=dict)


CASES = [
    Case("stand 60 s", 60.0, standing),
    Case("walk 10 m", 45.0, walking),
    Case("turn for 8 s at 0.4 rad/s", 10.0, turning),
    Case("stand 30 s, push of 40 N for 0.5 s in every 10 s", 30.0, standing, {"stress": "push", "level": 2}),
    Case("stand 30 s, push of 60 N for 0.5 s in every 10 s", 30.0, standing, {"stress": "push", "level": 3}),
]


@dataclass
class Outcome:
    """Result of a trial."""

    stands: bool
    distance_m: float
    farthest_m: float
    turned_rad: float
    tilt_rad: float
    seconds: float


def played(file: Path, case: Case, body: Body) -> Outcome:
    state = body.state()
    policy = policy_of(file, body.names, state.q_rad)
    farthest_m = turned_rad = tilted_rad = seconds = 0.0
    while seconds < case.seconds and not body.fallen():
        x_m, y_m = body.place()
        if case.velocity is walking and x_m >= 10.0:
            break
        before_rad = heading_rad(state.quaternion_wxyz)
        body.step(policy.act(state, case.velocity(seconds, state, y_m)))
        state = body.state()
        turned_rad += math.remainder(heading_rad(state.quaternion_wxyz) - before_rad, 2 * math.pi)
        tilted_rad = max(tilted_rad, tilt_rad(state.quaternion_wxyz))
        farthest_m = max(farthest_m, math.hypot(*body.place()))
        seconds += STEP_S
    outcome = Outcome(not body.fallen(), math.hypot(*body.place()), farthest_m, turned_rad, tilted_rad, seconds)
    body.close()
    return outcome


def line(where: str, case: Case, outcomes: list[Outcome]) -> str:
    """Returns a row of the table: means of distance, time and turn, and the greatest tilt."""
    mean = lambda name: sum(getattr(outcome, name) for outcome in outcomes) / len(outcomes)  # noqa: E731
    stood = sum(outcome.stands for outcome in outcomes)
    tilt_deg = math.degrees(max(outcome.tilt_rad for outcome in outcomes))
    return (
        f"| {case.name} | {where} | {stood} of {len(outcomes)} | {mean('distance_m'):.2f} | {mean('farthest_m'):.2f} "
        f"| {mean('turned_rad'):.2f} | {tilt_deg:.1f} | {mean('seconds'):.1f} |"
    )


def main() -> None:
    own = argparse.ArgumentParser(description=__doc__)
    own.add_argument("file", type=Path, help="the policy's file")
    own.add_argument("--seeds", type=int, nargs="+", default=[4100, 4101, 4102])
    given = own.parse_args()
    print("| case | where | stands | distance, m | farthest, m | turned, rad | tilt, deg | time, s |")
    print("|---|---|---|---|---|---|---|---|")
    wrong: list[str] = []
    for case in CASES:
        here = [played(given.file, case, TandemBody(seed, **case.stress)) for seed in given.seeds]
        print(line("Tandem", case, here), flush=True)
        if not case.stress:
            print(line("MuJoCo, 1 ms", case, [played(given.file, case, MujocoBody())]), flush=True)
        if not all(outcome.stands for outcome in here):
            wrong.append(f"{case.name}: fell")
        if case.velocity is walking and min(outcome.distance_m for outcome in here) < 10.0:
            wrong.append(f"{case.name}: less than 10 m")
        if case.velocity is turning and min(outcome.turned_rad for outcome in here) < 2.5:
            wrong.append(f"{case.name}: less than 2.5 rad")
    if wrong:
        raise SystemExit("; ".join(wrong))
    print("fine")


if __name__ == "__main__":
    main()
