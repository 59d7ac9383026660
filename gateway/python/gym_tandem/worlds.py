"""Common part of all environments: worlds of one task in Rust, and the arrays that they write into."""

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
from tandem.rows import DEFAULT_SIZE_PX, EGOCENTRIC, RATES_HZ, RowContract, check_contract

Observation = dict[str, Any]

LARGEST_SEED = 2**32 - 1

CHOICES: dict[str, tuple[str, ...]] = {
    "obs_type": ("pixels_agent_pos", "pixels", "state"),
    "action_type": ("joints", "wrists"),
    "reward_type": ("sparse", "dense"),
    "sensors": ("ideal", "g1"),
    "camera": ("ideal", "d435i"),
    "renderer": ("auto", "cpu", "gpu", "path"),
}
"""What options may be, the default first."""

EPISODE_SETTINGS = ("renderer", "sensors", "camera", "stress", "level")
"""Options that mean what they mean to `tandem.Episode`, which has the same defaults."""


class Options(TypedDict, total=False):
    """Options of every environment. Names are those of LeRobot's environments if these have the option."""

    obs_type: Literal["state", "pixels", "pixels_agent_pos"]
    """What is observed: `agent_pos` alone, `pixels` alone, or both, which is the default."""

    observation_width: int
    """Width of pictures; 320."""

    observation_height: int
    """Height of pictures, which see as high an angle at any size, and as wide as they are; 240."""

    fps: int
    """Steps per second: 50, 25 or 10. Joint targets are reached at the end of a step, on a straight line; 50."""

    data_set: str | PathLike[str] | None
    """Folder of a data set, of `tandem export lerobot`, whose rows the environment must have; what differs is refused."""

    look_every: int
    """Pictures are drawn at every so manieth step, and where an episode begins or ends; in between they stay the same. 1."""

    action_type: Literal["joints", "wrists"]
    """What a robot's row means: 31 joint targets and the base command, or wrists, fingers and the base command; "joints"."""

    reward_type: Literal["sparse", "dense"]
    """1 for each phase reached, or what a step adds to the task's progress; "sparse"."""

    sensors: Literal["ideal", "g1"]
    """What robots sense; "ideal"."""

    camera: Literal["ideal", "d435i"]
    """Model of the robots' cameras; "ideal"."""

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
    """Outcome of a step or a reset, with an entry per world."""

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
    """Returns the task in the wording of its episodes under this stress."""
    with tandem.Episode(told.id, protocol="benchmark", stress="words", level=options.get("level")) as episode:
        return replace(told, instruction=episode.briefing.instruction, robots=episode.briefing.instructions)


def environment_contract(task: TaskInfo, options: Options, *, apart: bool = False) -> RowContract:
    """Returns the layout of an environment's rows.

    Args:
        apart: True for separate rows of each robot.
    """
    fps = integer(options.get("fps", RATES_HZ[0]), "fps")
    if fps not in RATES_HZ:
        raise ValueError(f"no fps {fps}; have: {', '.join(map(str, RATES_HZ))}")
    settings = {key: value for key, value in options.items() if key in EPISODE_SETTINGS}
    layout = _native.row_contract(task.id, json.dumps(settings), options.get("action_type", "joints"))
    robots = None if apart else tuple(robot.robot for robot in task.robots)
    observed = options.get("obs_type", "pixels_agent_pos")
    images = {} if observed == "state" else dict.fromkeys(robots or (EGOCENTRIC,), picture_size(options))
    contract = RowContract.from_native(layout, robots, fps, images)
    return replace(contract, state=()) if observed == "pixels" else contract


def picture_size(options: Options) -> tuple[int, int]:
    """Returns width and height of images."""
    width, height = DEFAULT_SIZE_PX
    sides = options.get("observation_width", width), options.get("observation_height", height)
    return integer(sides[0], "observation_width"), integer(sides[1], "observation_height")


class Worlds:
    """Worlds of one task, with their spaces and observations."""

    def __init__(self, task: str, count: int, *, threads: int, options: Options, keeps_last: bool, apart: bool = False) -> None:
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
        self.robots = tuple(instruction.robot for instruction in told.robots)
        self.size = picture_size(options)
        self.look_every = integer(options.get("look_every", 1), "look_every")
        if min(self.size) < 1 or self.look_every < 1:
            raise ValueError(f"pictures of {self.size} at every step of {self.look_every}; give numbers from 1 on")
        self.contract = environment_contract(told, options, apart=apart)
        if (data_set := options.get("data_set")) is not None:
            check_contract(data_set, self.contract)
        steps_per_row = RATES_HZ[0] // self.contract.rate_hz
        self.max_episode_steps = -(-(rules.episode_steps - rules.initial_hold_steps) // steps_per_row)
        self.sees, self.senses = bool(self.contract.images), bool(self.contract.state)
        self._action_columns = len(self.contract.action) // (1 if apart else len(self.robots))
        settings = {key: value for key, value in options.items() if key in EPISODE_SETTINGS}
        record = options.get("record")
        self._native = _native.Worlds(
            task,
            json.dumps(settings),
            count,
            threads,
            options.get("action_type", "joints"),
            self.contract.rate_hz,
            options.get("reward_type", "sparse"),
            self.size if self.sees else None,
            record,
        )
        # This also happens at the end of the process, because a recording is complete only once it is closed.
        self.close = weakref.finalize(self, self._native.close)
        self._steps = 0
        self._seen = self._arrays()
        self._last = self._arrays() if keeps_last else None

    @staticmethod
    def _check(options: Options) -> None:
        """Refuses unknown values of an option."""
        for name, known in CHOICES.items():
            given = options.get(name, known[0])
            if given not in known:
                raise ValueError(f"no {name} {given!r}; have: {', '.join(known)}")

    def _arrays(self) -> tuple[NDArray[np.float32], NDArray[np.uint8] | None]:
        width, height = self.size
        states = np.zeros((self.count, len(self.robots), _native.row_state_columns()), np.float32)
        if not self.sees:
            return states, None
        return states, np.zeros((self.count, len(self.robots), height, width, 3), np.uint8)

    def action_box(self) -> gym.Space[NDArray[np.float32]]:
        """Returns the space of actions of the contract. Values beyond a limit are clamped."""
        limits = np.array([(column.min, column.max) for column in self.contract.action], np.float32)
        box: gym.Space[Any] = gym.spaces.Box(limits[:, 0], limits[:, 1], dtype=np.float32)
        return box

    def observation_dict(self) -> gym.spaces.Dict:
        """Returns the space of observations of the contract."""
        spaces: dict[str, gym.Space[Any]] = {}
        if self.senses:
            spaces["agent_pos"] = gym.spaces.Box(-np.inf, np.inf, (len(self.contract.state),), np.float32)
        if self.sees:
            width, height = self.size
            picture = gym.spaces.Box(0, 255, (height, width, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict(dict.fromkeys(self.contract.images, picture))
        return gym.spaces.Dict(spaces)

    def reset(self, seeds: list[int | None], chosen: list[bool] | None = None) -> Outcome:
        """Begins an episode in each world, or in the chosen ones; without a seed, the one of its next round."""
        begun = [-1 if seed is None else integer(seed, "a seed") for seed in seeds]
        for seed, number in zip(seeds, begun, strict=True):
            if seed is not None and not 0 <= number <= LARGEST_SEED:
                raise ValueError(f"no seed {seed}; give one from 0 to {LARGEST_SEED}")
        if chosen is None:
            self._steps = 0
            chosen = [True] * self.count
        return Outcome(*self._native.reset(chosen, begun, self._seen))

    def step(self, actions: ArrayLike, autoreset: str) -> Outcome:
        """Executes a row in each world, or begins its next episode."""
        rows: NDArray[np.float32] = np.ascontiguousarray(actions, np.float32)
        robots, width = len(self.robots), self._action_columns
        shape = (self.count, robots, width)
        shapes = [(self.count, robots * width), shape]
        if self.count == 1:
            shapes += [(robots * width,), (robots, width)]
        # An array with the same number of values in another order would be misread.
        if rows.shape not in shapes:
            raise ValueError(f"actions have the shape {rows.shape}; give {' or '.join(map(str, shapes))}")
        self._steps += 1
        looks = self._steps % self.look_every == 0
        return Outcome(*self._native.step(np.reshape(rows, shape), autoreset, looks, self._seen, self._last))

    def batch(self) -> Observation:
        """Returns the observations of all worlds. The next step writes into the same arrays."""
        states, pictures = self._seen
        seen: Observation = {"agent_pos": np.reshape(states, (self.count, -1))} if self.senses else {}
        if pictures is not None:
            seen["pixels"] = {robot: pictures[:, index] for index, robot in enumerate(self.robots)}
        return seen

    def of_world(self, world: int, *, last: bool = False) -> Observation:
        """Returns a copy of one world's observation; of the episode before, if that has ended in the same step."""
        states, pictures = self._last if last and self._last is not None else self._seen
        seen: Observation = {"agent_pos": states[world].ravel().copy()} if self.senses else {}
        if pictures is not None:
            seen["pixels"] = {robot: pictures[world, index].copy() for index, robot in enumerate(self.robots)}
        return seen

    def of_robot(self, index: int) -> Observation:
        """Returns a copy of the observation of one robot of the first world."""
        states, pictures = self._seen
        seen: Observation = {"agent_pos": states[0, index].copy()} if self.senses else {}
        if pictures is not None:
            seen["pixels"] = {EGOCENTRIC: pictures[0, index].copy()}
        return seen

    def draw(self, world: int) -> NDArray[np.uint8]:
        """Returns the images of all robots of a world, side by side."""
        return np.concatenate(list(self._native.draw(world, self.size)), axis=1)

    def state_hash(self, world: int) -> str:
        """Returns 16 hexadecimal digits that are equal for equal physical states of the same build."""
        return self._native.state_hash(world)

    def info(self, outcome: Outcome, world: int) -> dict[str, Any]:
        """Returns the information on one world besides its observation."""
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
