"""Plays episodes by `gateway/examples/agents/agent.py`, two at a time, and checks their files.

    cargo build --release
    python tests/peers/policies/agent.py target/release/tandem
"""

import json
import pathlib
import subprocess
import sys
import tempfile

AGENT = pathlib.Path(__file__).resolve().parents[3] / "gateway/examples/agents/agent.py"


def main():
    if len(sys.argv) != 2:
        sys.exit(f"usage: python {sys.argv[0]} target/release/tandem")
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.argv[1], "evaluate", "--policy", f"exec:{sys.executable} {AGENT}", "--tasks", "handover,move_house"]
        subprocess.run([*command, "--seeds", "0-1", "--jobs", "2", "--out", folder], check=True)
        folder = pathlib.Path(folder)
        episodes = json.loads((folder / "results.json").read_text())["episodes"]
        assert len(episodes) == 4, episodes
        for episode in episodes:
            kept = folder / "episodes" / f"{episode['task']}-{episode['seed']}"
            said = (kept / "stdout.txt").read_text()
            robots = 3 if episode["task"] == "move_house" else 2
            assert said.count(" arrived {") == robots, said + (kept / "stderr.txt").read_text()
            assert said.startswith((kept / "brief.txt").read_text())
            assert (kept / "episode.mcap").exists()
            assert episode["ended"] == "finished" and episode["note"].startswith("p1 was not reached in"), episode
            print(f"{episode['task']:12} seed {episode['seed']}  {episode['tool_calls']} calls, {episode['env_steps']} steps")


main()
