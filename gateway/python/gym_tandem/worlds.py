"""What all environments share: worlds of one task in Rust, and the arrays that they write into."""

from __future__ import annotations

import json
import weakref
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import TypedDict

import tandem
from tandem import _native
from tandem.base import StressAxis, StressLevel, integer
from tandem.contract.start import TaskInfo

Observation = dict[str, Any]

STATE_COLUMNS = 47
"""Numbers of a robot's state: 43 joint angles (rad) and the base command in force (m/s, m/s, rad/s, m)."""

LARGEST_SEED = 2**32 - 1

CHOICES: dict[str, tuple[str, ...]] = {
    "obs_type": ("pixels_agent_pos", "pixels", "state"),
    "action_type": ("joints", "wrists"),
    "reward_type": ("sparse", "dense"),
    "sensors": ("ideal", "g1"),
    "renderer": ("auto", "cpu", "gpu", "path"),
}
"""What options may be, the default first."""

EPISODE_SETTINGS = ("renderer", "sensors", "stress", "level")
"""Options that mean what they mean to `tandem.Episode`, which has the same defaults."""


class Options(TypedDict, total=False):
    """What every environment takes beside the task. Names are those of LeRobot's environments, where it has one."""

    obs_type: Literal["state", "pixels", "pixels_agent_pos"]
    """What is observed: `agent_pos` alone, `pixels` alone, or both, which is the default."""

    observation_width: int
    """Width of pictures; 320."""

    observation_height: int
    """Height of pictures, which see as high an angle at any size, and as wide as they are; 240."""

    look_every: int
    """Pictures are drawn at every so manieth step, and where an episode begins or ends; in between they stay the same. 1."""

    action_type: Literal["joints", "wrists"]
    """What a robot's row means: 31 joint targets and the base command, or wrists, fingers and the base command; "joints"."""

    reward_type: Literal["sparse", "dense"]
    """1 for each phase reached, or what a step adds to the task's progress; "sparse"."""

    sensors: Literal["ideal", "g1"]
    """What robots sense; "ideal"."""

    stress: StressAxis
    """What goes wrong, as for `tandem.Episode`; nothing where it is left out."""

    level: StressLevel
    """How much of it; 1."""

    renderer: Literal["auto", "cpu", "gpu", "path"]
    """Who draws; "auto"."""

    record: str | PathLike[str] | None
    """Folder in which every episode leaves one of its own with its recording. None: nothing is written."""


@dataclass(frozen=True)
class Outcome:
    """What a step came to, or a reset: an entry each world."""

    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    phases: NDArray[np.int64]
    fallen: NDArray[np.bool_]
    """Worlds by robots."""
    env_steps: NDArray[np.int64]
    seeds: NDArray[np.int64]
    """Of the episode that the step was of."""
    next_seeds: NDArray[np.int64]
    """Of the episode that has begun behind it, in the same step; -1 where none has."""
    failures: list[tuple[int, str]]
    """Worlds in which the simulator failed, and how."""
    clamped: NDArray[np.float64]
    """The share of the episode's joint targets that lay beyond the joints' limits, as degrees for radians do."""


def _reworded(told: TaskInfo, options: Options) -> TaskInfo:
    """The task in the words that its episodes have under this stress."""
    with tandem.Episode(told.id, protocol="benchmark", stress="words", level=options.get("level")) as episode:
        return replace(told, instruction=episode.briefing.instruction, robots=episode.briefing.instructions)


class Worlds:
    """Worlds of one task, their spaces, and what is seen of them."""

    def __init__(self, task: str, count: int, *, threads: int, options: Options, keeps_last: bool) -> None:
        told = next((entry for entry in tandem.tasks().tasks if entry.id == task), None)
        if told is None:
            have = ", ".join(entry.id for entry in tandem.tasks().tasks)
            raise ValueError(f"no task {task!r}; have: {have}")
        if count < 1 or threads < 0:
            raise ValueError(f"{count} worlds on {threads} threads; give at least 1 world, and 0 threads for one a core")
        unknown = options.keys() - Options.__annotations__.keys()
        if unknown:
            raise TypeError(f"no option {', '.join(sorted(unknown))}; have: {', '.join(Options.__annotations__)}")
        self._check(options)
        rules = next(rules for rules in told.protocols if rules.protocol == "benchmark")
        self.count = count
        self.task = _reworded(told, options) if options.get("stress") == "words" else told
        self.max_episode_steps = rules.episode_steps - rules.initial_hold_steps
        self.robots = tuple(instruction.robot for instruction in told.robots)
        width, height = options.get("observation_width", 320), options.get("observation_height", 240)
        self.size = integer(width, "observation_width"), integer(height, "observation_height")
        self.look_every = integer(options.get("look_every", 1), "look_every")
        if min(self.size) < 1 or self.look_every < 1:
            raise ValueError(f"pictures of {self.size} at every step of {self.look_every}; give numbers from 1 on")
        observed = options.get("obs_type", "pixels_agent_pos")
        self.sees, self.senses = observed != "state", observed != "pixels"
        settings = {key: value for key, value in options.items() if key in EPISODE_SETTINGS}
        record = options.get("record")
        self._native = _native.Worlds(
            task,
            json.dumps(settings),
            count,
            threads,
            options.get("action_type", "joints"),
            options.get("reward_type", "sparse"),
            self.size if self.sees else None,
            record,
        )
        # At the end of the process, too: a recording is whole only once it is closed.
        self.close = weakref.finalize(self, self._native.close)
        self._steps = 0
        self._seen = self._arrays()
        self._last = self._arrays() if keeps_last else None

    @staticmethod
    def _check(options: Options) -> None:
        """Refuses what an option does not know."""
        for name, known in CHOICES.items():
            given = options.get(name, known[0])
            if given not in known:
                raise ValueError(f"no {name} {given!r}; have: {', '.join(known)}")

    def _arrays(self) -> tuple[NDArray[np.float32], NDArray[np.uint8] | None]:
        width, height = self.size
        states = np.zeros((self.count, len(self.robots), STATE_COLUMNS), np.float32)
        if not self.sees:
            return states, None
        return states, np.zeros((self.count, len(self.robots), height, width, 3), np.uint8)

    def action_box(self, robots: int) -> gym.Space[NDArray[np.float32]]:
        """Rows of so many robots, one after another. What lies beyond a limit is moved there."""
        limits = np.tile(self._native.action_limits(), (robots, 1))
        box: gym.Space[Any] = gym.spaces.Box(limits[:, 0], limits[:, 1], dtype=np.float32)
        return box

    def observation_dict(self, robots: tuple[str, ...]) -> gym.spaces.Dict:
        """What is seen of these robots."""
        spaces: dict[str, gym.Space[Any]] = {}
        if self.senses:
            spaces["agent_pos"] = gym.spaces.Box(-np.inf, np.inf, (len(robots) * STATE_COLUMNS,), np.float32)
        if self.sees:
            width, height = self.size
            picture = gym.spaces.Box(0, 255, (height, width, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict({robot: picture for robot in robots})
        return gym.spaces.Dict(spaces)

    def reset(self, seeds: list[int | None], chosen: list[bool] | None = None) -> Outcome:
        """Begins an episode in each world, or in those that are chosen; without a seed, that of its next round."""
        begun = [-1 if seed is None else integer(seed, "a seed") for seed in seeds]
        for seed, number in zip(seeds, begun, strict=True):
            if seed is not None and not 0 <= number <= LARGEST_SEED:
                raise ValueError(f"no seed {seed}; give one from 0 to {LARGEST_SEED}")
        if chosen is None:
            self._steps = 0
            chosen = [True] * self.count
        return Outcome(*self._native.reset(chosen, begun, self._seen))

    def step(self, actions: ArrayLike, autoreset: str) -> Outcome:
        """One control step of each world, or the beginning of its next episode."""
        rows: NDArray[np.float32] = np.ascontiguousarray(actions, np.float32)
        robots, width = len(self.robots), self._native.action_limits().shape[0]
        shape = (self.count, robots, width)
        shapes = [(self.count, robots * width), shape]
        if self.count == 1:
            shapes += [(robots * width,), (robots, width)]
        # What has as many numbers in another order would be taken for what it is not.
        if rows.shape not in shapes:
            raise ValueError(f"actions have the shape {rows.shape}; give {' or '.join(map(str, shapes))}")
        self._steps += 1
        looks = self._steps % self.look_every == 0
        return Outcome(*self._native.step(np.reshape(rows, shape), autoreset, looks, self._seen, self._last))

    def batch(self) -> Observation:
        """What is seen of all worlds. Arrays are those that the next step writes into."""
        states, pictures = self._seen
        seen: Observation = {"agent_pos": np.reshape(states, (self.count, -1))} if self.senses else {}
        if pictures is not None:
            seen["pixels"] = {robot: pictures[:, index] for index, robot in enumerate(self.robots)}
        return seen

    def of_world(self, world: int, *, last: bool = False) -> Observation:
        """What is seen of one world, copied; of the episode before, where that has ended in the same step."""
        states, pictures = self._last if last and self._last is not None else self._seen
        seen: Observation = {"agent_pos": states[world].ravel().copy()} if self.senses else {}
        if pictures is not None:
            seen["pixels"] = {robot: pictures[world, index].copy() for index, robot in enumerate(self.robots)}
        return seen

    def of_robot(self, index: int) -> Observation:
        """What one robot of the first world sees and senses, copied."""
        states, pictures = self._seen
        seen: Observation = {"agent_pos": states[0, index].copy()} if self.senses else {}
        if pictures is not None:
            seen["pixels"] = {self.robots[index]: pictures[0, index].copy()}
        return seen

    def draw(self, world: int) -> NDArray[np.uint8]:
        """What all robots of a world see, side by side."""
        return np.concatenate(list(self._native.draw(world, self.size)), axis=1)

    def state_hash(self, world: int) -> str:
        """Equal for equal physical states of the same build, 16 hexadecimal digits."""
        return self._native.state_hash(world)

    def info(self, outcome: Outcome, world: int) -> dict[str, Any]:
        """What is told of one world beside what it sees."""
        told: dict[str, Any] = {
            "is_success": bool(outcome.phases[world] == len(self.task.phases)),
            "phases": int(outcome.phases[world]),
            "fallen": outcome.fallen[world].copy(),
            "seed": int(outcome.seeds[world]),
            "joints_clamped": float(outcome.clamped[world]),
        }
        for failed, how in outcome.failures:
            if failed == world:
                told["simulator_failure"] = how
        return told
