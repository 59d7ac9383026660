"""A team that communicates, with Python's standard library alone. The operator that is asked to inform the others sends a
message. The others wait for it, repeat it, and hold still. The example shows how messages pass; it grasps nothing.

    tandem evaluate --policy exec:"python3 gateway/examples/agents/words.py" --per-robot --talk --protocol benchmark \
        --tasks which_one --seeds 0 --out runs/words
"""

import json
import os
import re
import sys
import urllib.request

EPISODE = f"{os.environ['TANDEM_URL']}/v1/episodes/{os.environ['TANDEM_EPISODE']}"
ROBOT = os.environ["TANDEM_ROBOT"]
# Pattern of the instructions of tandem+: the option that the seed has chosen, and the request for a message.
TOLD = re.compile(r"[^.:]*\b(red|green|blue|yellow|orange)\b[^.:]*knows? that: say so")
WAITS = 20


def call(tool, **arguments):
    headers = {"content-type": "application/json", "authorization": f"Bearer {os.environ['TANDEM_TOKEN']}"}
    request = urllib.request.Request(f"{EPISODE}/tools/{tool}", json.dumps(arguments).encode(), headers)
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def main():
    sys.stdin.read()  # the brief, which a language model would be told
    with open(os.environ["TANDEM_START"], encoding="utf-8") as file:
        start = json.load(file)
    instruction = start["instructions"][0]["instruction"]
    secret = TOLD.search(instruction)
    if secret:
        call("say", text=f"The one that is wanted: {secret[1]}.")
    for _ in range(WAITS):
        heard = call("wait", steps=10).get("heard", [])
        for words in heard:
            print(f"{ROBOT} heard {words['from']}: {words['text']}")
        if heard and not secret:
            call("say", text=f"I heard you, {heard[0]['from']}. {heard[0]['text']}")
            secret = heard
    call("finish")


main()
