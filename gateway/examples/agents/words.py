"""A team that talks, of Python's standard library alone: who is asked to tell the others something says it; the others wait
until they have heard it, say it again, and hold still. It shows how words pass between operators, and takes nothing.

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
# What the instructions of tandem+ call what the seed has chosen, and how they ask for words.
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
