"""Calls a running server with what its own OpenAPI description allows and with what it does not, by `schemathesis`, all checks.

    pip install -r tests/peers/clients/fuzz.txt
    tandem serve --max-episodes 64 &
    python tests/peers/clients/fuzz.py http://127.0.0.1:8700 [OPERATION ...]

Every operation has an episode of its own, under the benchmark protocol. One thing JSON Schema cannot say, and it is left
out here: that a region names at most 256 pixels.
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import urllib.request

EXAMPLES = 60


def read(request):
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def new_episode(url):
    body = json.dumps({"task": "handover", "seed": 0, "protocol": "benchmark"}).encode()
    request = urllib.request.Request(f"{url}/v1/episodes", body, {"content-type": "application/json"})
    return read(request)["episode_id"]


def fuzz(url, document, operation, folder):
    """Whether every check passes on one operation."""
    # An episode of its own, so that one that ends is not missed by the others.
    config = folder / "schemathesis.toml"
    config.write_text(f'[parameters]\n"path.episode_id" = "{new_episode(url)}"\n')
    command = ["schemathesis", "--config-file", config, "run", document, "--url", url, "--checks", "all"]
    only = ["--include-operation-id", operation, "--max-examples", str(EXAMPLES)]
    done = subprocess.run(command + only, capture_output=True, text=True)
    print(f"{operation:20} {'fine' if done.returncode == 0 else 'FAILED'}")
    if done.returncode != 0:
        print(done.stdout)
    return done.returncode == 0


def check(url, only):
    openapi = read(f"{url}/v1/openapi.json")
    depth = openapi["paths"]["/v1/episodes/{episode_id}/tools/query_depth"]["post"]["requestBody"]
    region = depth["content"]["application/json"]["schema"]["properties"]["region"]["properties"]
    # That robots have equally many rows is said in fifty alternatives, for which the generator takes minutes; one robot has.
    chunk = openapi["paths"]["/v1/episodes/{episode_id}/tools/send_joint_chunk"]["post"]["requestBody"]
    robots = chunk["content"]["application/json"]["schema"]["properties"]["robots"]
    robots["maxItems"] = 1
    del robots["anyOf"]
    for corner in ("from", "to"):
        region[corner]["prefixItems"] = [{"type": "integer", "minimum": 0, "maximum": 15}] * 2
    operations = [method["operationId"] for path in openapi["paths"].values() for name, method in path.items() if name != "parameters"]
    operations = [operation for operation in operations if not only or operation in only]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        document = folder / "openapi.json"
        document.write_text(json.dumps(openapi))
        return all([fuzz(url, document, operation, folder) for operation in operations])


if __name__ == "__main__":
    sys.exit(0 if check(sys.argv[1], sys.argv[2:]) else 1)
