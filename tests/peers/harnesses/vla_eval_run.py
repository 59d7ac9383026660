"""`vla-eval run` of the harness vla-eval evaluates a policy behind its own wire in Handover, without containers.

    pip install -r tests/peers/harnesses/vla_eval.txt
    pip install "./gateway/python[gym]"
    python tests/peers/harnesses/vla_eval_run.py

The policy is a model server of the harness's own that tells the robots what an expert told them in the first of two episodes, in
chunks of 20 rows. It reaches every phase there, and does not see where the bottle stands in the other.
"""

import json
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

import numpy as np
import yaml
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve
from vla_eval.specs import IMAGE_RGB, LANGUAGE, DimSpec

from demonstration import SEED, TASK, rows

PORT = 18765
CHUNK = 20
EPISODES = 2


class Scripted(PredictModelServer):
    """Sends rows in their order, and then the last one repeatedly."""

    def __init__(self, told):
        super().__init__(chunk_size=CHUNK)
        self.told, self.looks, self.seen = told.reshape(len(told), -1), {}, []

    async def on_episode_start(self, config, ctx):
        await super().on_episode_start(config, ctx)
        self.looks[ctx.episode_id] = 0

    def predict(self, obs, ctx):
        look = self.looks[ctx.episode_id]
        self.looks[ctx.episode_id] += 1
        self.seen.append({**obs, "images": {name: image.shape for name, image in obs["images"].items()}})
        at = np.minimum(np.arange(look * CHUNK, (look + 1) * CHUNK), len(self.told) - 1)
        return {"actions": self.told[at]}

    def get_action_spec(self):
        return {"robots": DimSpec("robots", 0, "tandem_joints_base")}

    def get_observation_spec(self):
        return {"image": IMAGE_RGB, "state": DimSpec("state", 0, "joint_positions"), "language": LANGUAGE}


def wait_for(url):
    for _ in range(100):
        try:
            urllib.request.urlopen(url)
            return
        except OSError:
            time.sleep(0.1)
    raise TimeoutError(url)


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        server = Scripted(rows(folder / "expert"))
        threading.Thread(target=serve, args=[server], kwargs={"host": "127.0.0.1", "port": PORT}, daemon=True).start()
        wait_for(f"http://127.0.0.1:{PORT}/health")
        entry = {
            "benchmark": "vla_eval_tandem:TandemBenchmark",
            "tasks": [TASK],
            "episodes_per_task": EPISODES,
            "params": {"seed": SEED, "observation_width": 128, "observation_height": 96, "look_every": CHUNK},
            "recording": {"record_video": True, "video_fps": 50},
        }
        config = {"server": {"url": f"ws://127.0.0.1:{PORT}"}, "render": "cpu", "output_dir": str(folder / "results")}
        (folder / "tandem.yaml").write_text(yaml.safe_dump(config | {"benchmarks": [entry]}))
        command = [Path(sys.executable).parent / "vla-eval", "run", "--no-docker", "--config", folder / "tandem.yaml"]
        subprocess.run(command, check=True)
        print(*sorted(path.relative_to(folder) for path in folder.rglob("results/**/*")), sep="\n")
        [told] = [json.loads(path.read_text()) for path in (folder / "results").glob("*.json")]
        films = list((folder / "results").rglob("*.mp4"))
    [task] = told["tasks"]
    print(json.dumps(task, indent=1))
    first, second = (episode["metrics"] for episode in task["episodes"])
    assert first["success"] and first["phases"] == 3 and first["p1"], first
    assert task["episodes"][0]["steps"] < 1000 and len(films) == EPISODES, (task, films)
    [look, *_] = server.seen
    assert look["images"] == {"A": (96, 128, 3), "B": (96, 128, 3)}
    assert look["state"].shape == (94,) and look["instructions"].keys() == {"A", "B"} and look["task_description"]
    print(f"vla-eval: seed {SEED} p{first['phases']}, seed {SEED + 1} p{second['phases']}, {len(server.seen)} requests")


if __name__ == "__main__":
    main()
