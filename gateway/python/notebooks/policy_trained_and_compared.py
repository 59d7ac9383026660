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
# # A policy trained and compared
#
# Experts see object poses; a policy sees images. Here an expert demonstrates Handover a few times,
# and a small policy learns from that. The policy then plays unseen seeds, and is compared with the
# expert and with the floor, which is the result of a blind replay of one demonstration. With eight
# demonstrations and 200 steps the policy has only begun to learn. The book's page on baselines has
# results with more of both.
#
# It needs `pip install "./gateway/python[baselines,notebook]"`.

# %%
import csv
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import torch

import tandem
from tandem.baselines import TrainingSettings, load, train
from tandem.baselines.data import read
from tandem.export import ExportSettings, export_lerobot

runs = Path("runs")
torch.set_num_threads(1)


def run(*arguments):
    """A command of the program `tandem`, and what it prints."""
    done = subprocess.run([sys.executable, "-m", "tandem", *map(str, arguments)], capture_output=True, text=True)
    print(done.stdout or done.stderr)
    done.check_returncode()


# %% [markdown]
# ## Demonstrations
#
# Commands are slightly disturbed before the robots execute them, and the label is the expert's own
# command. So the policy learns to return from states beside the expert's path.

# %%
benchmark = ["--protocol", "benchmark", "--tasks", "handover"]
several = [*benchmark, "--seeds", "2000-2007", "--disturb", "1", "--only-successful", "--no-reports", "--jobs", "2"]
run("collect", *several, "--out", runs / "demonstrations")
settings = ExportSettings(images="png", size=(160, 120), rate_hz=10)
(exported,) = export_lerobot(runs / "demonstrations", runs / "data", settings)
print(exported.episodes, "episodes,", exported.rows, "moments")

# %% [markdown]
# ## Training
#
# Each training step uses 8 moments. The second task is to predict the positions of the objects from
# an image.

# %%
folder = train(runs / "data", runs / "policy", TrainingSettings(steps=200, batch=8))
with (folder / "training.csv").open() as file:
    curve = list(csv.DictReader(file))
figure, axis = plt.subplots(figsize=(6, 3))
for name in ("actions_loss", "objects_loss"):
    axis.plot([int(row["step"]) for row in curve], [float(row[name]) for row in curve], "o-", label=name)
axis.set_xlabel("step")
axis.legend()
plt.show()

# %% [markdown]
# ## The prediction for a moment of the data
#
# On the left is A's image. On the right is the elbow of its right arm over the next second, as
# commanded by the expert and by the policy.

# %%
policy = load(folder)
moments = read(runs / "data", policy.settings.chunk_rows, 1)
moment = len(moments) // 3
told = policy.act(moments.pictures[moment], moments.states[moment], range(2))
with tandem.Episode("handover", 2000) as episode:
    elbow = list(episode.action_columns).index("right_elbow_joint")
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3))
left.imshow(moments.pictures[moment, 0])
left.axis("off")
time_s = (np.arange(len(told)) + 1) / moments.rate_hz
right.plot(time_s, moments.chunks[moment, :, 0, elbow], label="expert")
right.plot(time_s, told[:, 0, elbow], label="policy")
right.set_xlabel("time / s")
right.set_ylabel("right elbow of A / rad")
right.legend()
plt.show()

# %% [markdown]
# ## Playing
#
# The policy is served at an address of this process, and `tandem evaluate` queries it like any
# policy behind a server. The floor replays one demonstration on the same seeds.

# %%
seeds = [*benchmark, "--seeds", "2100-2101", "--jobs", "2"]
with policy.serve() as server:
    asked = ["--policy", server.url, "--policy-map", folder / "map.toml", "--policy-name", "chunk"]
    run("evaluate", *asked, *seeds, "--out", runs / "chunk")
run("evaluate", "--policy", f"open-loop:{runs / 'demonstrations'}", *seeds, "--out", runs / "floor")
run("evaluate", "--policy", "expert", *seeds, "--out", runs / "expert")

# %%
table = tandem.report([runs / "chunk", runs / "floor", runs / "expert"], format="md", out=runs / "table.md")
print(table.read_text())
