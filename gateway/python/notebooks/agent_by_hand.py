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
# # An agent by hand
#
# The steps of a language model in an episode, done by hand: observe, measure, reach, close a hand,
# observe again. The example is Handover's first phase: robot A has to hold the bottle 3 cm above
# its initial place.

# %%
import matplotlib.pyplot as plt
import numpy as np

import tandem

episode = tandem.Episode("handover", seed=2000)
print(episode.start().instruction)

# %% [markdown]
# ## Look
#
# The bottle is the green object in front of A's right hand.

# %%
seen = episode.observe(["A"])
plt.imshow(seen.rgb["A"])
plt.title("what A sees")
plt.axis("off")
plt.show()

# %% [markdown]
# ## Measure
#
# `query_depth` finds a surface by its colour and returns its place in A's pelvis frame. An upright,
# round surface has an axis. The green surface is the bottle's body, whose lower end is at the
# counter.

# %%
body = episode.query_depth("A", surface=tandem.SurfaceQuery(color="green")).surfaces[0]
assert body.axis is not None
x, y, _ = body.axis.bottom_m
counter = episode.query_depth("A", pixels=[[120, 220]]).points[0]
counter_z = counter[4]
assert counter_z is not None
print(f"the bottle's axis: x {x:.3f} m, y {y:.3f} m; radius {body.axis.radius_m:.3f} m; the counter: z {counter_z:.3f} m")

# %% [markdown]
# ## Reach
#
# The briefing contains grips that work. The grip of a bottle gives the place of the bottle's axis
# in the wrist's frame (`place_m`), the hand's stops beside the bottle (`stops_m`), and the angles
# of open and closed fingers. `check_reach` predicts, at no cost, whether an arm reaches a pose.

# %%
grip = next(grip for grip in episode.briefing.brief.grips if "bottle" in grip.thing)
print(f"{grip.thing}: {grip.place} at {grip.place_m} in the wrist's frame")

GRASP_HEIGHT_M = 0.07
axis = np.array([x, y, counter_z + GRASP_HEIGHT_M])
# With this quaternion the wrist's axes are those of the pelvis, so that no rotation is needed.
assert grip.right_quaternion_wxyz == (1.0, 0.0, 0.0, 0.0)
around = axis - np.array(grip.place_m)
beside = around - np.array(grip.stops_m[0])
for name, position in {"beside": beside, "around": around}.items():
    reach = episode.check_reach("A", right_position_m=position, right_quaternion_wxyz=grip.right_quaternion_wxyz)
    assert reach.right is not None
    print(name, np.round(position, 3), reach.right)


# %%
def move(position, fingers):
    """A's right hand goes to a position, its fingers to angles: a second, in two commands of 25 steps."""
    hand = tandem.WristMove(
        "A",
        right_position_m=position,
        right_quaternion_wxyz=grip.right_quaternion_wxyz,
        right_fingers_rad=fingers,
    )
    episode.move_wrists(25, [hand])
    return episode.move_wrists(25, [hand])


for position in (beside + np.array([-0.10, 0.0, 0.10]), beside, around):
    right = move(position, grip.open_rad).robots[0].right
    print(right.state, f"{right.position_error_m * 1000:.1f} mm off")

# %% [markdown]
# ## Close the hand
#
# A hand holds an object while its thumb presses from one side, and fingers or palm from the other.
# The reply reports this.

# %%
held = move(around, grip.close_rad).robots[0].right
print("grip:", held.grip)

# %% [markdown]
# ## Lift, and observe again

# %%
reply = move(around + np.array([0.0, 0.0, 0.10]), grip.close_rad)
print("reached:", [(phase.number, phase.id, phase.time_s) for phase in reply.phases])
assert reply.phases, "the first phase was not reached"

after = episode.observe().rgb
figure, axes = plt.subplots(1, 2, figsize=(10, 4))
for axis_of, (robot, picture) in zip(axes, after.items(), strict=True):
    axis_of.imshow(picture)
    axis_of.set_title(f"robot {robot}")
    axis_of.axis("off")
plt.show()

# %%
result = episode.finish()
print(result.phases, f"{result.env_steps} steps, {result.tool_calls} calls")

# %% [markdown]
# The rest is B's part. Its hand comes to the upper half of the bottle and closes. A opens its hand
# and withdraws it, and B stands the bottle on the target between the robots. `tandem agent` lets a
# language model do all of this with the same calls.
