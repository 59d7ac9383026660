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
# # A first episode
#
# Two robots stand at a kitchen counter. Robot A is to lift a bottle and hand it to B, and B is to
# stand it on a target. Here you begin that episode, look through the robots' cameras, move a hand,
# and return to an earlier state.

# %%
import matplotlib.pyplot as plt
import numpy as np

import tandem

episode = tandem.Episode("handover", seed=2000)
briefing = episode.start()
print(briefing.instruction)

# %% [markdown]
# ## What the robots see
#
# `observe` renders the image of each robot's head camera, 320 by 240 pixels, and reads the robot's
# sensors. Physics is paused meanwhile, and while you think.

# %%
seen = episode.observe()
figure, axes = plt.subplots(1, 2, figsize=(10, 4))
for axis, (robot, picture) in zip(axes, seen.rgb.items(), strict=True):
    axis.imshow(picture)
    axis.set_title(f"robot {robot}, {seen.time_s:.2f} s")
    axis.axis("off")
plt.show()

# %% [markdown]
# ## What they sense
#
# Poses of wrists are in the robot's own pelvis frame: x forward, y left, z up, in metres.

# %%
state = episode.get_robot_state("A")
print("right wrist of A:", np.round(state.right_wrist.position_m, 3))
print("numbers of a state:", episode.state().shape, "as", episode.state_columns[:3], "...")

# %% [markdown]
# ## Moving a hand
#
# `move_wrists` moves hands to poses in a straight line. A command has at most 25 steps, which are
# half a second. Its reply contains the resulting poses and the remaining budget. Here the hand goes
# up and to the side: the first command brings it near its target, and the second one to it.

# %%
before = episode.snapshot()
x, y, z = state.right_wrist.position_m
raise_hand = tandem.WristMove("A", right_position_m=[x + 0.10, y - 0.05, z + 0.20])
for _ in range(2):
    reply = episode.move_wrists(25, [raise_hand])
right = reply.robots[0].right
print(f"{reply.stop_reason}; the hand has {right.state}, {right.position_error_m * 1000:.1f} mm off")
print(f"{reply.budget.steps_left} steps are left")

# %%
raised = episode.observe(["A"]).rgb["A"]
figure, axes = plt.subplots(1, 2, figsize=(10, 4))
for axis, (title, picture) in zip(axes, {"before": seen.rgb["A"], "after": raised}.items(), strict=True):
    axis.imshow(picture)
    axis.set_title(f"A, {title}")
    axis.axis("off")
plt.show()

# %% [markdown]
# ## The same again
#
# An episode returns to a snapshot, and the same commands lead to the same state, bit for bit.
# `state_hash` shows that.

# %%
hash_then = episode.state_hash
episode.restore(before)
for _ in range(2):
    episode.move_wrists(25, [raise_hand])
assert episode.state_hash == hash_then
print(episode.state_hash)

# %% [markdown]
# ## The end
#
# A result lists the phases that were reached. Nobody has lifted the bottle, so there are none.

# %%
result = episode.finish()
print(result.ended, result.phases, f"{result.env_steps} steps, {result.tool_calls} calls")
