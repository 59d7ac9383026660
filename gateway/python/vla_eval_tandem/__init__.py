"""Tandem's tasks as a benchmark of the harness `vla-eval`, which its own command runs without containers.

vla-eval run --no-docker --config tandem.yaml, where an entry of `benchmarks` has `benchmark: vla_eval_tandem:TandemBenchmark`
"""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from vla_eval.benchmarks.base import StepBenchmark, StepResult
from vla_eval.recording import EpisodeRecorder, NullEpisodeRecorder
from vla_eval.specs import IMAGE_RGB, LANGUAGE, DimSpec
from vla_eval.types import Action, EpisodeResult, Observation, Task

import tandem
from gym_tandem import Options, TandemEnv
from gym_tandem.worlds import environment_contract


class TandemBenchmark(StepBenchmark):
    """All tasks under the benchmark protocol; a step is one row, or one for each row of a chunk.

    Observations: `images`, by robot what its head camera sees; `task_description`, what the robots do together, and
    `instructions`, by robot what its own part is; `state` (and `states`, as some servers call it): for each robot in turn 43
    joint angles in radians and the base command.
    Actions: `actions`, for each robot in turn 31 joint targets in radians and the base command (`gym_tandem` has them in
    full); several rows are a chunk, played before the server is asked again.
    Results: `success`, `phases` (how many were reached), and `p1` to `p3`, whose means are the rates of the task's table.

    Args:
        seed: That of every task's first episode; episode i has the seed i further on. 0 to 100 are for results.

    The rest is as in `gym_tandem.Options`.
    """

    render_backends: ClassVar[frozenset[str]] = frozenset({"cpu", "gpu"})
    _renderer: ClassVar[Literal["auto", "cpu"]] = "auto"

    @classmethod
    def configure_render(cls, mode: str) -> dict[str, str]:
        """Pictures by the embedded renderer for "cpu", and for "gpu" by a graphics processor where there is one."""
        cls._renderer = "cpu" if mode == "cpu" else "auto"
        return {}

    def __init__(
        self,
        seed: int = 2000,
        observation_width: int = 320,
        observation_height: int = 240,
        fps: int = 50,
        look_every: int = 1,
        action_type: Literal["joints", "wrists"] = "joints",
        sensors: Literal["ideal", "g1"] = "ideal",
        camera: Literal["ideal", "d435i"] = "ideal",
        record: str | None = None,
    ) -> None:
        super().__init__()
        self._recorder: EpisodeRecorder = NullEpisodeRecorder()
        self._seed = seed
        self._options: Options = {
            "observation_width": observation_width,
            "observation_height": observation_height,
            "fps": fps,
            "look_every": look_every,
            "action_type": action_type,
            "sensors": sensors,
            "camera": camera,
            "record": record,
            "renderer": self._renderer,
        }
        self._tasks = {told.id: told for told in tandem.tasks().tasks}
        self._env: TandemEnv | None = None

    def get_tasks(self) -> list[Task]:
        return [{"name": name, "suite": told.suite or "tandem"} for name, told in self._tasks.items()]

    def reset(self, task: Task) -> Any:
        if self._env is None or self._env.task != task["name"]:
            self.cleanup()
            self._env = TandemEnv(task["name"], **self._options)
        observed, _ = self._env.reset(seed=self._seed + int(task.get("episode_idx", 0)))
        self._film(observed)
        return observed

    def step(self, action: Action) -> StepResult:
        if self._env is None:
            raise RuntimeError("no episode has begun; call reset first")
        space: Any = self._env.action_space
        width: int = space.shape[0]
        rows = np.atleast_2d(np.asarray(action["actions"], np.float32))
        if rows.ndim != 2 or rows.shape[0] == 0 or rows.shape[1] != width:
            raise ValueError(f"actions have the shape {rows.shape}; {self._env.task} takes ({width},), or (rows, {width})")
        result = StepResult(obs=None, reward=0.0, done=False, info={})
        for row in rows:
            observed, reward, terminated, truncated, info = self._env.step(row)
            if "simulator_failure" in info:
                raise RuntimeError(f"the simulator failed, which is not the policy's fault: {info['simulator_failure']}")
            result = StepResult(observed, result.reward + reward, terminated or truncated, info)
            self._film(observed)
            if result.done:
                break
        return result

    def make_obs(self, raw_obs: Any, task: Task) -> Observation:
        told = self._tasks[task["name"]]
        return {
            "images": raw_obs["pixels"],
            "task_description": told.instruction,
            "instructions": {robot.robot: robot.instruction for robot in told.robots},
            "state": raw_obs["agent_pos"],
            "states": raw_obs["agent_pos"],
        }

    def get_step_result(self, step_result: StepResult) -> EpisodeResult:
        info = step_result.info
        phases = int(info.get("phases", 0))
        reached = {f"p{number}": phases >= number for number in (1, 2, 3)}
        return {"success": bool(info.get("is_success", False)), "phases": phases, **reached}

    def get_metric_keys(self) -> dict[str, str]:
        return dict.fromkeys(("success", "phases", "p1", "p2", "p3"), "mean")

    def get_metadata(self) -> dict[str, Any]:
        budgets = [
            rules.episode_steps for told in self._tasks.values() for rules in told.protocols if rules.protocol == "benchmark"
        ]
        # An episode ends by its own budget, which is never more.
        return {"max_steps": max(budgets), "fps": self._options.get("fps")}

    def get_action_spec(self) -> dict[str, DimSpec]:
        joints = self._options.get("action_type") == "joints"
        what = "31 joint targets (rad) and the base command" if joints else "wrists, fingers and the base command"
        form = "tandem_joints_base" if joints else "tandem_wrists_fingers_base"
        return {"robots": DimSpec("robots", 0, form, description=f"for each robot in turn {what}")}

    def get_observation_spec(self) -> dict[str, DimSpec]:
        task = next(iter(self._tasks.values()))
        columns = len(environment_contract(task, self._options).state) // len(task.robots)
        state = f"for each robot in turn {columns} numbers: 43 joint angles (rad) and the base command"
        return {
            "image": IMAGE_RGB,
            "state": DimSpec("state", 0, "joint_positions", description=state),
            "language": LANGUAGE,
        }

    def _film(self, observed: Any) -> None:
        """What all robots see, side by side, where the harness keeps a film."""
        if self._recorder.is_active:
            self._recorder.record_video(np.concatenate(list(observed["pixels"].values()), axis=1))

    def cleanup(self) -> None:
        if self._env is not None:
            self._env.close()
            self._env = None


__all__ = ["TandemBenchmark"]
