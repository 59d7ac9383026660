# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Record, look and score
#
# An episode leaves a recording with everything in it: sensor values and commands of the robots,
# poses of the objects, and contacts. Here an expert plays an episode, which is then analysed. After
# that a policy of your own is scored beside it.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import tandem

runs = Path("runs")
shown = tandem.collect("handover", 2000, out=runs / "demonstrations", protocol="benchmark")
print(shown.results[0].phases)

# %% [markdown]
# ## The content of a recording
#
# Every array begins with the state before the first step; 50 steps are a second.

# %%
recording = tandem.Recording(runs / "demonstrations/episodes/handover-2000")
print(len(recording), "states of", recording.robots, "and", recording.objects)
print("joint angles", recording.q_rad.shape, "actions", recording.actions.shape, "contacts", recording.contact_force_n.shape)
print("calls:", len(recording.calls), "the first of them", [call.tool for call in recording.calls[:3]])
for phase in recording.phases:
    print(f"{phase.number} {phase.id} at {phase.time_s:.2f} s")

# %% [markdown]
# ## The height of the bottle, and the forces on it

# %%
bottle = recording.objects.index("bottle")
RIGHT = 1
height_m = recording.objects_in_world[:, bottle, 2] - recording.objects_in_world[0, bottle, 2]
# Sums of the forces of thumb, fingers and palm.
pressed_n = np.linalg.norm(recording.contact_force_n[:, :, RIGHT, bottle], axis=-1).sum(axis=-1)
figure, (above, below) = plt.subplots(2, 1, figsize=(9, 5), sharex=True)
above.plot(recording.time_s, height_m)
above.set_ylabel("bottle's height / m")
for robot, name in enumerate(recording.robots):
    below.plot(recording.time_s, pressed_n[:, robot], label=f"right hand of {name}")
below.set_ylabel("normal forces / N")
below.set_xlabel("time / s")
below.legend()
for phase in recording.phases:
    for axis in (above, below):
        axis.axvline(phase.time_s, color="grey", linestyle=":")
plt.show()

# %% [markdown]
# ## Looking at it
#
# Images need not be recorded: any camera can render any step afterwards, in any size. These are the
# moments at which phases were reached.

# %%
steps = [int(np.searchsorted(recording.time_s, phase.time_s)) for phase in recording.phases]
figure, axes = plt.subplots(1, len(steps), figsize=(12, 4))
for axis, step, phase in zip(axes, steps, recording.phases, strict=True):
    axis.imshow(recording.picture("third_person", min(step, len(recording) - 1), size=(400, 300)).rgb)
    axis.set_title(f"{phase.number} {phase.id}")
    axis.axis("off")
plt.show()


# %% [markdown]
# ## Scoring
#
# A policy is any function that receives each episode as it begins. This one only lifts A's right
# hand. `evaluate` plays it on several seeds. `collect` has recorded the expert on one seed, and
# `report` puts both in one table.


# %%
def lift_a_hand(episode):
    x, y, z = episode.get_robot_state("A").right_wrist.position_m
    episode.move_wrists(25, [tandem.WristMove("A", right_position_m=[x, y, z + 0.1])])


seeds = range(2000, 2003)
mine = tandem.evaluate(lift_a_hand, "handover", seeds, protocol="benchmark", out=runs / "mine")
theirs = tandem.evaluate("expert", "handover", seeds, protocol="benchmark", out=runs / "expert")
for name, evaluation in {"lift_a_hand": mine, "expert": theirs}.items():
    counted = evaluation.tasks["handover"]
    reached = ", ".join(f"{phase} {getattr(counted, phase)}" for phase in ("p1", "p2", "p3"))
    print(f"{name:12} {reached} of {counted.episodes}")
print("why:", mine.notes[0])
assert theirs.tasks["handover"].p3 == len(seeds)

# %%
table = tandem.report([runs / "mine", runs / "expert"], format="md", out=runs / "table.md")
print(table.read_text())
