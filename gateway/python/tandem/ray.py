"""Evaluations on a Ray cluster: every episode is a Ray task, and all results are in one folder, as if one machine
had played them.

    import ray, tandem.ray

    ray.init(address="auto")
    tandem.ray.evaluate(policy, "all", range(1, 101), out="runs/mine", protocol="benchmark")
    tandem.report("runs/mine")

Every machine needs the same wheel and the policy's imports. The folder is on the calling machine; recordings are
sent to it through Ray's object store.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from .errors import TandemError
from .evaluation import Evaluation, EvaluationSettings, Plan, Played, Policy, demonstrations, seed_list, task_ids

if TYPE_CHECKING:
    from typing_extensions import Unpack

try:
    # Its types are partly unknown.
    ray: Any = import_module("ray")
except ModuleNotFoundError as missing:
    raise ModuleNotFoundError("Ray is not installed; pip install 'tandem-sim[ray]' adds it", name="ray") from missing

_LOOK_S = 0.2
"""Interval between two checks whether the user wants to stop."""

_LOST = (
    ray.exceptions.WorkerCrashedError,
    ray.exceptions.NodeDiedError,
    ray.exceptions.OutOfMemoryError,
    ray.exceptions.ObjectLostError,
)
"""Errors that end only the task of one episode, after all retries."""

_COLOURS = "\x1b\\[[0-9;]*m"


def evaluate(
    policy: Policy,
    tasks: str | Iterable[str] | None = None,
    seeds: int | Iterable[int] = range(10),
    jobs: int | None = None,
    *,
    retries: int = 3,
    task_options: Mapping[str, Any] | None = None,
    **settings: Unpack[EvaluationSettings],
) -> Evaluation:
    """Does the same as `tandem.evaluate`, with the same results and hashes, in the processes of a cluster.

    Args:
        policy: As in `tandem.evaluate`. A process unpickles it once and calls it for one episode after another, so data
            loaded in its first call stays loaded.
        jobs: Number of parallel episodes. None: the number of processors of the cluster at the start.
        retries: Number of retries of an episode whose process or machine was lost. After that, the episode is listed in
            `left_out`, and the next evaluation into the same folder plays it.
        task_options: Ray options of an episode's task, for example {"num_cpus": 2} or {"num_gpus": 0.25}; one processor
            by default.
        settings: As in `tandem.evaluate`. A `scene`, `robot`, `task_file`, `instructions` or `seed_key` has to be at
            the same path on every machine.
    """
    plan = Plan.of(policy, tasks, seeds, settings)
    options: dict[str, Any] = {"num_cpus": 1, "max_retries": retries, **(task_options or {})}
    if not ray.is_initialized():
        ray.init()
    play = ray.remote(**options)(_player(plan))

    def ask(task: str, seed: int, is_interrupted: Callable[[], bool]) -> Played:
        episode = play.remote(task, seed)
        while not ray.wait([episode], timeout=_LOOK_S)[0]:
            if is_interrupted():
                ray.cancel(episode, force=True)
                raise KeyboardInterrupt
        try:
            return ray.get(episode)
        except _LOST as lost:
            text = str(lost).splitlines()[0]
            return False, f"its process was lost ({type(lost).__name__}: {text})"
        except ray.exceptions.RayError as error:
            text = re.sub(_COLOURS, "", str(error)).strip()
            raise TandemError(f"a task of Ray failed; mend what it says here: {text}") from error

    at_once = jobs or max(1, int(ray.cluster_resources().get("CPU", 1) // max(1, options["num_cpus"])))
    return plan.evaluated(lambda folder: plan.play_elsewhere(ask, folder, at_once))


def collect(
    tasks: str | Iterable[str] | None = None,
    seeds: int | Iterable[int] = range(10),
    jobs: int | None = None,
    *,
    retries: int = 3,
    task_options: Mapping[str, Any] | None = None,
    **settings: Unpack[EvaluationSettings],
) -> Evaluation:
    """Does the same as `tandem.collect`, in the processes of a cluster; see `evaluate`."""
    tasks, seeds = task_ids(tasks, settings), seed_list(seeds)
    whole = demonstrations(tasks, seeds, settings)
    return evaluate("expert", tasks, seeds, jobs, retries=retries, task_options=task_options, **whole)


def _player(plan: Plan) -> Callable[[str, int], Played]:
    """Returns the function with which a process of the cluster plays an episode. It includes the plan, which every
    process reads once.
    """
    shared = plan.part("", 0)

    def play(task: str, seed: int) -> Played:
        with TemporaryDirectory(prefix="tandem-") as folder:
            raw = shared.part(task, seed).play(Path(folder))
            if not raw["episodes"]:
                # The calling evaluation adds the name of the episode itself.
                return False, raw["left_out"][0].partition(": ")[2]
            recording = Path(folder) / "episodes" / f"{task}-{seed}"
            files = [(path.name, path.read_bytes()) for path in sorted(recording.iterdir())] if shared.record else []
            return True, (json.dumps(raw["episodes"][0]), files)

    return play
