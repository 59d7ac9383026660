"""Tandem's tasks in the harness Inspect Robots: an embodiment of all robots of a task, its episodes, and its phases as a score.

inspect-robots run --task tandem -T task=handover -T seeds=2000-2009 --embodiment tandem -E task=handover --policy ...
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from inspect_robots.embodiment import (
    AUTO_RESET,
    PRIVILEGED_SUCCESS,
    RENDERABLE,
    RESETTABLE,
    SEEDABLE,
    EmbodimentBase,
    EmbodimentInfo,
)
from inspect_robots.rollout import TrialRecord
from inspect_robots.scene import Scene, Target
from inspect_robots.scorer import Score, success_at_end
from inspect_robots.spaces import ActionSemantics, Box, CameraSpec, ObservationSpace, StateField, StateSpec
from inspect_robots.task import Task
from inspect_robots.types import Action, Observation, StepResult
from numpy.typing import NDArray

import tandem
from gym_tandem import Options, TandemEnv
from gym_tandem.worlds import LARGEST_SEED

# Maximum distance of a target from the one before it: that of the experts' targets in one step of 20 ms.
_ARM_STEP_RAD = 0.08
_FINGER_STEP_RAD = 0.35
_HEIGHT_STEP_M = 0.06

_NOTES = """{robots} Unitree G1 humanoids with Dex3 hands, which have to work together; dimensions begin with a robot's name.
{parts}
- Joint targets are absolute radians. Base commands are velocities (vx_m_s forward, vy_m_s to the left, yaw_rate_rad_s), which
  stay in force until they are set to 0, and the height of the pelvis (0.74 when standing upright).
- A dimension that is not named holds where it was measured. Fingers that hold something have stopped short of their targets:
  name them in every motion, with targets beyond where they are, or they let go.
- Each robot's picture is from its head camera. A control step is 20 ms; the world stands still between motions.
- The episode ends by itself when the task is done, when a robot falls, or after {steps} steps."""


def _told(task: str) -> Any:
    tasks = {told.id: told for told in tandem.tasks().tasks}
    if task not in tasks:
        raise ValueError(f"no task {task!r}; have: {', '.join(tasks)}")
    return tasks[task]


class TandemEmbodiment(EmbodimentBase):
    """All robots of a task, under the benchmark protocol; an action is one control step of 20 ms.

    Actions: for each robot in turn 31 joint targets and the base command (`joint_pos`), as `dim_labels` name them. With
    `action_type="wrists"` both wrists' poses in its pelvis frame, as positions and quaternions w, x, y, z (`eef_abs_pose`,
    `quat_wxyz`), both hands' fingers and the base command; the harness has no limits for these, nor an agent.
    State: `joint_pos`, the measured values of the commanded joints, in their order; `joint_pos_all`, for each robot in turn 43
    joint angles and the base command.
    Episodes: a scene's `init_seed` is Tandem's seed, so that its epochs begin alike; a scene without one uses the trial's seed.
    Success is the last phase. `info` has `success`, `phases` (the number reached), `is_fallen` and Tandem's `seed`.

    Args:
        task: Id of a task.

    The other arguments are those of `gym_tandem.Options`. With `look_every`, images in between are reused, and take no memory.
    """

    def __init__(
        self,
        task: str = "handover",
        *,
        observation_width: int = 320,
        observation_height: int = 240,
        look_every: int = 1,
        action_type: Literal["joints", "wrists"] = "joints",
        sensors: Literal["ideal", "g1"] = "ideal",
        camera: Literal["ideal", "d435i"] = "ideal",
        renderer: Literal["auto", "cpu", "gpu", "path"] = "auto",
        record: str | None = None,
    ) -> None:
        told = _told(task)
        options: Options = {
            "observation_width": observation_width,
            "observation_height": observation_height,
            "look_every": look_every,
            "action_type": action_type,
            "sensors": sensors,
            "camera": camera,
            "renderer": renderer,
            "record": record,
        }
        self._env = TandemEnv(task, **options)
        self._look_every = look_every
        self._steps = 0
        self._images: dict[str, NDArray[np.uint8]] = {}
        self._instruction: str | None = None
        self._robots = [robot.robot for robot in told.robots]
        self._tells_joints = action_type == "joints"
        size = {"height": observation_height, "width": observation_width}
        action_space = self._action_space()
        state = [column.name for column in self._env.contract.state]
        self._in_state = [state.index(column.name) for column in self._env.contract.action if column.name in state]
        fields = [StateField("joint_pos_all", (len(state),), "rad")]
        if self._tells_joints:
            fields.insert(0, StateField("joint_pos", action_space.shape, "rad"))
        parts = "\n".join(f"- {robot.robot}: {robot.instruction}" for robot in told.robots)
        self.info = EmbodimentInfo(
            name="tandem",
            action_space=action_space,
            observation_space=ObservationSpace(
                cameras=tuple(CameraSpec(robot, **size) for robot in self._robots), state=StateSpec(tuple(fields))
            ),
            control_hz=50.0,
            is_simulated=True,
            capabilities=frozenset({SEEDABLE, RESETTABLE, AUTO_RESET, PRIVILEGED_SUCCESS, RENDERABLE}),
            docs=_NOTES.format(robots=len(self._robots), parts=parts, steps=self._env._max_episode_steps),
            environment_id=f"tandem/{task}",
            environment_revision=tandem.__version__,
        )

    def _action_space(self) -> Box:
        bounds: Any = self._env.action_space
        low, high = np.asarray(bounds.low, np.float64), np.asarray(bounds.high, np.float64)
        row = [column.name for column in self._env.contract.action]
        return Box(
            low.shape,
            low,
            high,
            ActionSemantics(
                "joint_pos" if self._tells_joints else "eef_abs_pose",
                "none" if self._tells_joints else "quat_wxyz",
                dim_labels=tuple(name.replace(".", "_").removesuffix("_rad") for name in row),
                max_step=tuple(_largest_step(name, float(width)) for name, width in zip(row, high - low, strict=True)),
            ),
        )

    def reset(self, scene: Scene, *, seed: int | None = None) -> Observation:
        begun = scene.init_seed if scene.init_seed is not None else seed
        observed, _ = self._env.reset(seed=None if begun is None else begun % (LARGEST_SEED + 1))
        self._steps = 0
        self._instruction = scene.instruction
        self._images = observed["pixels"]
        return self._observation(observed)

    def step(self, action: Action) -> StepResult:
        row = np.asarray(action.data, np.float32)
        if row.shape != self.info.action_space.shape:
            raise ValueError(f"an action has the shape {row.shape}; give {self.info.action_space.shape}")
        observed, reward, terminated, truncated, info = self._env.step(row)
        if "simulator_failure" in info:
            raise RuntimeError(f"the simulator failed, which is not the policy's fault: {info['simulator_failure']}")
        self._steps += 1
        if terminated or truncated or self._steps % self._look_every == 0:
            self._images = observed["pixels"]
        success = bool(info["is_success"])
        told = {"success": success, "phases": info["phases"], "is_fallen": info["fallen"].tolist(), "seed": info["seed"]}
        reason = ("success" if success else "fall") if terminated else None
        return StepResult(self._observation(observed), reward, terminated, reason, truncated, told)

    def _observation(self, observed: Any) -> Observation:
        measured = np.asarray(observed["agent_pos"], np.float64)
        state = {"joint_pos_all": measured}
        if self._tells_joints:
            state["joint_pos"] = measured[self._in_state]
        time_s = 0.02 * self._steps
        looked_s = 0.02 * (self._steps - self._steps % self._look_every)
        return Observation(self._images, state, self._instruction, dict.fromkeys(self._images, looked_s), time_s)

    def close(self) -> None:
        self._env.close()


def _largest_step(name: str, width: float) -> float:
    if "_hand_" in name:
        return _FINGER_STEP_RAD
    if name.endswith("_joint_rad"):
        return _ARM_STEP_RAD
    # Velocities are commanded at once, and the base controller follows them gradually; poses have no limit for each number.
    return _HEIGHT_STEP_M if name.endswith("pelvis_height_m") else width


@dataclass(frozen=True)
class _Phases:
    name: str = "tandem_phases"

    def __call__(self, record: TrialRecord, target: Target | None) -> Score:
        phases = int(record.steps[-1].result.info.get("phases", 0)) if record.steps else 0
        return Score(phases, f"reached {phases} of 3 phases")


def tandem_phases() -> _Phases:
    """Scores an episode by the number of phases reached, 0 to 3."""
    return _Phases()


def tandem_task(task: str = "handover", seeds: str | int = "2000-2009") -> Task:
    """Returns a task's episodes, a scene for each seed: `seeds` is one, or a range with both ends. 0 to 100 are for results."""
    told = _told(task)
    first, _, last = str(seeds).partition("-")
    if not first.isdigit() or not (last.isdigit() or not last) or int(last or first) < int(first):
        raise ValueError(f"no seeds {seeds!r}; give one, for example 2000, or a range, for example 2000-2009")
    rules = next(rules for rules in told.protocols if rules.protocol == "benchmark")
    return Task(
        name=f"tandem-{task}",
        scenes=[
            Scene(f"{task}-{seed}", told.instruction, init_seed=seed) for seed in range(int(first), int(last or first) + 1)
        ],
        scorer=[success_at_end(), tandem_phases()],
        max_steps=rules.episode_steps - rules.initial_hold_steps,
    )


__all__ = ["TandemEmbodiment", "tandem_phases", "tandem_task"]
