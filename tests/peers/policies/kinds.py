"""Plays episodes by policies of other kinds than rows of joints at 50 Hz, behind openpi's WebSocket and behind `/act`: one tells poses
of wrists, one differences at 15 Hz, one sees two moments, as diffusion policies do. What robots then do is looked at.

    pip install -r tests/peers/policies/openpi.txt -r tests/peers/policies/act.txt
    cargo build --release
    python tests/peers/policies/kinds.py target/release/tandem
"""

import json
import pathlib
import subprocess
import tempfile

import numpy as np

import act
import openpi
from arm_raise import tandem_of_command_line

STEPS = 1000  # of Handover under the benchmark protocol
CONTROL_HZ = 50


class Policy:
    """Stores its requests by robot, whose instructions differ. The first request is a trial with zeros."""

    def __init__(self):
        self.trial, self.seen = None, {}

    def infer(self, observation):
        if self.trial is None:
            self.trial = observation
            return self.decide(observation)
        self.seen.setdefault(observation["prompt"], []).append(observation)
        return self.decide(observation)

    def of(self, words):
        [found] = [seen for prompt, seen in self.seen.items() if words in prompt]
        return found


GIVER = "Take the bottle"


class Reach(Policy):
    """Sends the right wrist to a place before the robot, palm down, at 3 cm a row of 0.1 s, and closes the hand on the way."""

    MAP = """
        preset = "openpi"
        [images]
        "image" = { camera = "egocentric", size = [64, 48] }
        [state]
        "wrist" = ["right_wrist_position", "right_wrist_rows_6d"]
        "pelvis" = ["pelvis_in_start"]
        [action]
        "pose" = ["right_wrist_position", "right_wrist_rows_6d"]
        "rest" = ["right_hand", "base_command"]
        [chunk]
        rows = 10
        rate_hz = 10
        wrist_frame = "FRAME"
    """
    ROWS = 10
    STEP_M = 0.03
    GOAL_M = np.array([0.32, -0.22, 0.14])
    PALM_DOWN = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # a quarter turn about x, to the left palm's side
    CLOSED = [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3]

    def __init__(self, frame, walk_m_s=0.0):
        super().__init__()
        self.map, self.frame, self.walk_m_s = self.MAP.replace("FRAME", frame), frame, walk_m_s

    def decide(self, observation):
        wrist, pelvis = observation["wrist"], observation["pelvis"]
        at = wrist[:3]
        goal, rotation = self.GOAL_M, self.PALM_DOWN
        if self.frame == "start":
            # Where the pelvis stands now is where the goal was said to be; after the first second it stays in the room.
            if len(self.seen) and not hasattr(self, "room"):
                self.room = {}
            key = observation["prompt"]
            if self.trial is not observation:
                self.room.setdefault(key, pelvis[:3] + self.GOAL_M)
                goal, at = self.room[key], pelvis[:3] + at
        way = goal - at
        steps = np.minimum(np.arange(1, self.ROWS + 1) * self.STEP_M / max(np.linalg.norm(way), 1e-6), 1)
        position = at + steps[:, None] * way
        pose = np.concatenate([position, np.repeat(rotation[:2].reshape(1, 6), self.ROWS, axis=0)], axis=1)
        rest = np.repeat([[*self.CLOSED, self.walk_m_s, 0, 0, 0.74]], self.ROWS, axis=0)
        return {"pose": pose.astype(np.float32), "rest": rest.astype(np.float32)}

    def check(self, episode):
        seen = self.of(GIVER)
        assert len(seen) == STEPS / 50, len(seen)
        for moment in (len(seen) // 2, -1):
            wrist = seen[moment]["wrist"]
            goal = self.GOAL_M
            if self.frame == "start":
                goal = self.room[seen[0]["prompt"]] - seen[moment]["pelvis"][:3]
            off_m = np.linalg.norm(wrist[:3] - goal)
            turned = np.degrees(np.arccos(np.clip(wrist[3:6] @ self.PALM_DOWN[0], -1, 1)))
            print(f"             after {moment % len(seen)} s {100 * off_m:.1f} cm and {turned:.1f} degrees off")
            assert off_m < 0.02 and turned < 6, wrist
        assert episode["tool_calls"] == 20 + 200, episode["tool_calls"]


class Nudge(Policy):
    """Turns joints of the right arm by steps towards their targets: differences to the measured angles, at 15 Hz."""

    MAP = """
        preset = "openpi"
        [images]
        [state]
        "state" = ["right_arm", "pelvis_height_m"]
        [action]
        "action" = ["right_arm", "pelvis_height_m"]
        [chunk]
        rows = 15
        rate_hz = 15
        between = "BETWEEN"
        delta = ["right_arm", "pelvis_height_m"]
    """
    ROWS = 15
    GOAL = np.array([-0.5, -0.3, 0.0, 0.6, 0.0, 0.2, -0.2, 0.70])
    FASTEST = 0.04  # rad a row

    def __init__(self, between):
        super().__init__()
        self.map = self.MAP.replace("BETWEEN", between)

    def decide(self, observation):
        way = self.GOAL - observation["state"]
        steps = np.arange(1, self.ROWS + 1)[:, None] * self.FASTEST
        rows = np.sign(way) * np.minimum(np.abs(way), steps)
        return {"action": rows.astype(np.float32)}

    def check(self, episode):
        seen = self.of(GIVER)
        assert len(seen) == STEPS / 50, len(seen)
        off = np.abs(seen[-1]["state"] - self.GOAL)
        print(f"             {off[:7].max():.3f} rad and {off[7]:.3f} m off after {len(seen) - 1} s")
        assert off.max() < 0.1, off  # gravity bends the arm


class Swing(Policy):
    """Swings a wrist with increasing speed up to the target speed, by the observations of two moments 0.1 s apart. It plans 16 rows
    of 0.1 s and half of them are executed, as with diffusion policies."""

    MAP = """
        preset = "openpi"
        leading_axes = 1
        [images]
        "image" = { camera = "egocentric", size = [96, 96], fit = "crop", layout = "chw" }
        [state]
        "agent_pos" = ["left_arm"]
        [action]
        "action" = ["left_arm"]
        [chunk]
        rows = 16
        execute = 8
        rate_hz = 10
        [history]
        length = 2
        stride = 1
    """
    ROWS = 16
    SPEED = 0.05  # rad a row
    WRIST = 6

    def __init__(self):
        super().__init__()
        self.map, self.way = self.MAP, {}

    def decide(self, observation):
        assert observation["image"].shape == (1, 2, 3, 96, 96), observation["image"].shape
        assert observation["agent_pos"].shape == (1, 2, 7), observation["agent_pos"].shape
        before, now = observation["agent_pos"][0]
        speed = float(now[self.WRIST] - before[self.WRIST])
        key = observation["prompt"]
        way = self.way.setdefault(key, 1)
        if abs(now[self.WRIST]) > 0.6 and np.sign(now[self.WRIST]) == way:
            way = self.way[key] = -way
        speeds = np.clip(speed + way * 0.02 * np.arange(1, self.ROWS + 1), -self.SPEED, self.SPEED)
        rows = np.repeat(now[None], self.ROWS, axis=0)
        rows[:, self.WRIST] += np.cumsum(speeds)
        return {"action": rows[None].astype(np.float32)}

    def check(self, episode):
        seen = self.of(GIVER)
        assert len(seen) == STEPS / 40, len(seen)
        states = np.stack([look["agent_pos"][0] for look in seen])
        assert np.array_equal(states[0, 0], states[0, 1]), "before the first look, it was as then"
        speeds = states[1:, 1, self.WRIST] - states[1:, 0, self.WRIST]
        moved = np.abs(speeds)
        print(f"             wrist from {states[:, 1, self.WRIST].min():.2f} to {states[:, 1, self.WRIST].max():.2f} rad,"
              f" {moved.min():.3f} to {moved.max():.3f} rad in 0.1 s")
        # What it feels in 0.1 s is what it was told, and not what happens in a whole chunk of 0.8 s.
        assert np.median(moved) < 1.2 * self.SPEED and np.median(moved) > 0.8 * self.SPEED, speeds
        assert states[:, 1, self.WRIST].max() > 0.5 and states[:, 1, self.WRIST].min() < -0.5
        pictures = [look["image"][0] for look in seen[1:]]
        assert all((picture[0] != picture[1]).any() for picture in pictures), "two moments"


def play(tandem, name, policy, flag):
    """Handover, seed 2000, recorded, and replayed."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "map.toml").write_text(policy.map)
        told = subprocess.run([tandem, "policy-map", "check", folder / "map.toml"], capture_output=True, text=True, check=True)
        assert told.stdout.startswith("2 robots: "), told
        command = [tandem, "evaluate", "--tasks", "handover", "--seeds", "2000", "--protocol", "benchmark", "--record"]
        command += ["--policy", flag(policy), "--policy-map", folder / "map.toml", "--out", folder / "out"]
        done = subprocess.run(command, capture_output=True, text=True)
        results = json.loads((folder / "out/results.json").read_text())
        assert results["episodes"], done.stdout + done.stderr
        [episode] = results["episodes"]
        print(f"{name:12} {episode['ended']}, {episode['tool_calls']} calls, {episode.get('note')}")
        policy.check(episode)
        assert (episode["ended"], episode["env_steps"]) == ("step_budget_exhausted", STEPS), episode
        recording = folder / "out/episodes/handover-2000/episode.mcap"
        replayed = subprocess.run([tandem, "replay", "--verify", recording], capture_output=True, text=True)
        assert replayed.returncode == 0, replayed.stdout + replayed.stderr


def main():
    tandem = tandem_of_command_line()
    over_openpi = lambda policy: f"openpi:ws://127.0.0.1:{openpi.serve(policy)}"
    over_act = lambda policy: f"act:{act.serve(policy)}"
    play(tandem, "reach", Reach("pelvis"), over_openpi)
    play(tandem, "reach, start", Reach("start"), over_openpi)
    play(tandem, "nudge", Nudge("interpolate"), over_act)
    play(tandem, "nudge, hold", Nudge("hold"), over_act)
    play(tandem, "swing", Swing(), over_openpi)


if __name__ == "__main__":
    main()
