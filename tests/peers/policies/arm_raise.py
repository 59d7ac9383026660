"""A policy that does something that can be checked: robot A raises its left arm, robot B keeps its posture. The checks are of what
the policy is shown, of what it then feels, and of the results."""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

JOINTS = 43
SHOULDER = 15  # left_shoulder_pitch_joint
RAISED_RAD = -0.8
ROWS = 50
# Action rows: arms, hands, waist; states: legs, waist, left arm and hand, right arm and hand.
UPPER = [*range(15, 22), *range(29, 36), *range(22, 29), *range(36, 43), *range(12, 15)]
HEIGHT_M = 0.74


class ArmRaise:
    def __init__(self):
        self.seen = []
        self.first = {}  # by words, which are a robot's own

    def infer(self, observation):
        """Rows of actions for an observation under the keys of the preset `openpi`."""
        state = observation["observation/state"]
        self.seen.append(observation)
        if not observation["observation/image"].any():
            first = state  # a trial without a robot
        else:
            first = self.first.setdefault(observation["prompt"], state)
        target = np.concatenate([first[UPPER], [0, 0, 0, HEIGHT_M]]).astype(np.float32)
        rows = np.repeat(target[None], ROWS, axis=0)
        if "Take the bottle" in observation["prompt"]:
            rows[:, 0] = np.linspace(state[SHOULDER], RAISED_RAD, ROWS)
        return {"actions": rows}

    def check(self):
        """Checks the observations by robot: 20 chunks each, after a trial with black images."""
        trial, *looks = self.seen
        assert not trial["observation/image"].any() and not trial["observation/state"].any()
        assert len(looks) == 40, len(looks)
        for look in looks:
            image, state = look["observation/image"], look["observation/state"]
            assert (image.shape, image.dtype) == ((224, 224, 3), np.uint8)
            assert not image[:28].any() and not image[-28:].any(), "padded above and below"
            assert image[28:-28].mean() > 40, "and a picture between"
            assert (state.shape, state.dtype) == ((JOINTS,), np.float32)
        a, b = looks[0::2], looks[1::2]
        assert a[0]["prompt"] != b[0]["prompt"]
        assert np.abs(a[0]["observation/image"].astype(int) - b[0]["observation/image"]).mean() > 1
        angles = [float(look["observation/state"][SHOULDER]) for look in a]
        assert abs(angles[0] - RAISED_RAD) > 0.5, angles
        assert all(abs(angle - RAISED_RAD) < 0.05 for angle in angles[2:]), angles
        assert abs(b[-1]["observation/state"][SHOULDER] - b[0]["observation/state"][SHOULDER]) < 0.05


def evaluate(tandem, *flags):
    """Result of `tandem evaluate` for Handover, seed 1."""
    with tempfile.TemporaryDirectory() as folder:
        command = [tandem, "evaluate", "--tasks", "handover", "--seeds", "1", "--out", folder, *flags]
        done = subprocess.run(command, capture_output=True, text=True)
        results = json.loads((pathlib.Path(folder) / "results.json").read_text())
    return results, done


def tandem_of_command_line():
    if len(sys.argv) != 2:
        sys.exit(f"usage: python {sys.argv[0]} target/release/tandem")
    return sys.argv[1]
