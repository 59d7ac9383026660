"""Sends valid and invalid calls by its OpenAPI description to a running server, by `schemathesis` with all checks.

    pip install -r tests/peers/clients/fuzz.txt
    tandem serve --max-episodes 512 &
    python tests/peers/clients/fuzz.py http://127.0.0.1:8700 [OPERATION ...]

The first run calls every operation but DELETE, each on a live episode of its own, and says how far the episode has come. The second
run calls all operations together, DELETE among them, on episodes that they share. The protocol is the benchmark's.

Two things the description of all episodes cannot say, and they are left out here. A region names at most 4096 pixels. An episode of
two robots has no C, which is then refused with 422 though the description allows it; the list of an episode's own tools does not.
So the task has three robots, and the server has to be one that holds no other episodes, since the list leads to them.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.request

EXAMPLES = 160
# Of the second run, in which operations meet.
SHARED_EXAMPLES = 60
SHARED_EPISODES = 16
# Thirty seconds of simulation on a busy machine.
LONGEST_CALL_S = 120
DELETE = "delete_episode"
COMMANDS = ["move_wrists", "walk", "send_joint_chunk", "wait"]


def read(request):
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def new_episode(url):
    body = json.dumps({"task": "move_house", "seed": 0, "protocol": "benchmark"}).encode()
    request = urllib.request.Request(f"{url}/v1/episodes", body, {"content-type": "application/json"})
    return read(request)["episode_id"]


def held(url):
    """The episodes of the server, by id."""
    return {entry["episode_id"]: entry for entry in read(f"{url}/v1/episodes")["episodes"]}


def schemathesis(url, document, folder, config, flags):
    """Returns whether every check passes, and the number of requests."""
    (folder / "openapi.json").write_text(json.dumps(document))
    (folder / "schemathesis.toml").write_text(config)
    command = ["schemathesis", "--config-file", folder / "schemathesis.toml", "run", folder / "openapi.json"]
    command += ["--url", url, "--checks", "all", "--request-timeout", str(LONGEST_CALL_S)]
    done = subprocess.run(command + flags, capture_output=True, text=True)
    if done.returncode != 0:
        print(done.stdout, done.stderr)
    cases = re.search(r"(\d+) generated", done.stdout)
    return done.returncode == 0, int(cases[1]) if cases else 0


def fuzz_one(url, document, operation, folder):
    """Returns whether every check passes on one operation and its commands are executed, and the number of requests."""
    # An episode of its own, so that one that ends is not missed by the others.
    episode = new_episode(url)
    config = f'[parameters]\n"path.episode_id" = "{episode}"\n'
    flags = ["--include-operation-id", operation, "--max-examples", str(EXAMPLES)]
    fine, cases = schemathesis(url, document, folder, config, flags)
    entry = held(url)[episode]
    if operation in COMMANDS and entry["step"] == 0:
        print(f"{operation}: no command was carried out")
        fine = False
    word = "fine" if fine else "FAILED"
    print(f"{operation:20} {word:6} {cases:5} requests, {entry['step']} steps, ended: {entry['ended']}", flush=True)
    return fine, cases


def fuzz_together(url, document, folder):
    """Returns whether every check passes on all operations together, which delete episodes, and the number of requests."""
    document = json.loads(json.dumps(document))
    shared = [new_episode(url) for _ in range(SHARED_EPISODES)]
    for path in document["paths"].values():
        for parameter in path.get("parameters", []):
            parameter["schema"] = {"type": "string", "enum": shared}
    fine, cases = schemathesis(url, document, folder, "", ["--max-examples", str(SHARED_EXAMPLES)])
    deleted = [episode for episode in shared if episode not in held(url)]
    if not deleted:
        print("no episode was deleted")
        fine = False
    word = "fine" if fine else "FAILED"
    print(f"{'all, with DELETE':20} {word:6} {cases:5} requests, {len(deleted)} of {len(shared)} episodes deleted")
    return fine, cases


def description(url):
    """The server's OpenAPI description, narrowed where JSON Schema cannot express a rule."""
    document = read(f"{url}/v1/openapi.json")

    def body(tool):
        post = document["paths"][f"/v1/episodes/{{episode_id}}/tools/{tool}"]["post"]
        return post["requestBody"]["content"]["application/json"]["schema"]["properties"]

    # Fifty alternatives state that robots have equally many rows. The generator would take minutes, so only one robot has rows.
    planned = body("send_plan")["commands"]["items"]["anyOf"]
    chunks = [body("send_joint_chunk")]
    chunks += [one["properties"]["arguments"]["properties"] for one in planned if one["properties"]["tool"]["const"] == "send_joint_chunk"]
    for chunk in chunks:
        chunk["robots"]["maxItems"] = 1
        del chunk["robots"]["anyOf"]
    region = body("query_depth")["region"]["properties"]
    for corner in ("from", "to"):
        region[corner]["prefixItems"] = [{"type": "integer", "minimum": 0, "maximum": 15}] * 2
    return document


def check(url, only):
    if others := list(held(url)):
        sys.exit(f"the server holds {', '.join(others)}; start one for this alone")
    document = description(url)
    operations = [method["operationId"] for path in document["paths"].values() for name, method in path.items() if name != "parameters"]
    first = [operation for operation in operations if operation != DELETE and (not only or operation in only)]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        runs = [fuzz_one(url, document, operation, folder) for operation in first]
        if not only or DELETE in only:
            runs.append(fuzz_together(url, document, folder))
    print(f"{sum(cases for _, cases in runs)} requests")
    return all(fine for fine, _ in runs)


if __name__ == "__main__":
    sys.exit(0 if check(sys.argv[1], sys.argv[2:]) else 1)
