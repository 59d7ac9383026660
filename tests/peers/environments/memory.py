"""Memory left by episodes: plays short ones of all tasks in turn, and prints the growth of the process.

    pip install ./gateway/python
    python tests/peers/environments/memory.py [--episodes 1000] [--most-growth 0.02]

Each kind of episode has a process of its own, with one arena of the allocator: in arenas of their own, threads that come and go
keep what others freed, which took recorded episodes from 49 to 55 MB in 1,000 where one arena stays at 42. What is built once, as the shapes of all ten scenes, is there when every task has
been played, from where growth is counted; it has to stay within 2 %. So few as 50 episodes need more: an allocator that serves
several threads settles slowly, and one episode that is held would be 20 %. Freed memory is given back to the system before it
is measured, so that what is told is what is held.
"""

import argparse
import ctypes
import gc
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import tandem

BLOCKS = 10
TASKS = 10


def held_bytes():
    """Returns the memory that the process uses, without pages of files."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    resident, shared = map(int, Path("/proc/self/statm").read_text().split()[1:3])
    return (resident - shared) * os.sysconf("SC_PAGE_SIZE")


def state_only(task, seed, folder):
    with tandem.Episode(task, seed) as episode:
        episode.wait(5)
        episode.state()
        episode.restore(episode.snapshot())
        episode.finish()


def with_pictures(task, seed, folder):
    with tandem.Episode(task, seed, renderer="cpu") as episode:
        episode.observe(depth=False)
        episode.wait(5)
        episode.observe()
        episode.finish()


def recorded(task, seed, folder):
    with tandem.Episode(task, seed, renderer="cpu", record=folder / f"{task}-{seed}") as episode:
        episode.observe()
        episode.wait(5)
        episode.finish()


def raising(task, seed, folder):
    """A policy that raises an exception, in an episode that is never closed."""
    episode = tandem.Episode(task, seed)
    try:
        episode.start()
        episode.wait(10_000)
    except tandem.Refused:
        pass


KINDS = {play.__name__: play for play in (state_only, with_pictures, recorded, raising)}


def measure(kind, episodes):
    """Held bytes after each tenth of the episodes."""
    tasks = [task.id for task in tandem.tasks().tasks if task.suite is None]
    assert len(tasks) == TASKS
    held = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(episodes):
            KINDS[kind](tasks[number % len(tasks)], 2000 + number, Path(folder))
            if (number + 1) % (episodes // BLOCKS) == 0:
                held.append(held_bytes())
    return held


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=1000)
    parser.add_argument("--most-growth", type=float, default=0.02)
    parser.add_argument("--kinds", nargs="*", choices=KINDS, default=list(KINDS))
    given = parser.parse_args()
    leaks = []
    for kind in given.kinds:
        # Read by the allocator when the process begins.
        os.environ["MALLOC_ARENA_MAX"] = "1"
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            held = pool.submit(measure, kind, given.episodes).result()
        begun = held[-(-TASKS // (given.episodes // BLOCKS)) - 1]
        growth = held[-1] / begun - 1
        told = ", ".join(f"{bytes_ / 1e6:.1f}" for bytes_ in held)
        print(f"{kind}: {given.episodes} episodes, MB held after each tenth: {told}; {growth:+.1%}", flush=True)
        leaks += [kind] if growth > given.most_growth else []
    if leaks:
        sys.exit(f"grew by more than {given.most_growth:.0%}: {', '.join(leaks)}")


if __name__ == "__main__":
    main()
