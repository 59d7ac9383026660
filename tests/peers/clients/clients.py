"""Checks a running server with the official clients of its interfaces: MCP (the Python SDK, one major version or the other, and the
inspector), the types and strict modes of the OpenAI and Anthropic SDKs, and the OpenAPI validator.

    pip install -r tests/peers/clients/clients.txt                 # or, in another environment, -r tests/peers/clients/clients_mcp2.txt
    tandem serve &
    python tests/peers/clients/clients.py http://127.0.0.1:8700

Where `npx` is installed, the inspector is checked, too. What of an SDK is not installed is left out, and said.
"""

import asyncio
import importlib.util
import itertools
import json
import os
import shutil
import subprocess
import sys
import urllib.request

PLAY = {"task": "handover", "seed": 0, "protocol": "benchmark"}
INSPECTOR = os.environ.get("INSPECTOR", "npx --yes @modelcontextprotocol/inspector").split()


def read(url):
    with urllib.request.urlopen(url) as answer:
        return json.load(answer)


def schemas(schema):
    """A schema and every schema below it."""
    yield schema
    for inner in [*schema.get("properties", {}).values(), *schema.get("anyOf", [])]:
        yield from schemas(inner)
    if "items" in schema:
        yield from schemas(schema["items"])


# What a strict schema may say: https://developers.openai.com/api/docs/guides/structured-outputs and
# https://platform.claude.com/docs/en/build-with-claude/structured-outputs have these in common.
KEYWORDS = {"type", "description", "properties", "required", "additionalProperties", "items", "anyOf", "enum"}


# The arguments of its commands are those of other tools, which no strict schema can say.
NOT_STRICT = ["send_plan"]


def strict_ones(tools):
    assert [tool["name"] for tool in tools if not tool.get("strict")] == NOT_STRICT
    return [tool for tool in tools if tool["name"] not in NOT_STRICT]


def check_keywords(tools, key):
    for tool in tools:
        assert len(tool["name"]) <= 64 and len(tool["description"]) <= 1024, tool["name"]
        for schema in schemas(tool[key]):
            assert set(schema) <= KEYWORDS, (tool["name"], set(schema) - KEYWORDS)
            assert not isinstance(schema.get("type"), list), (tool["name"], schema)
            if schema.get("type") == "object":
                assert schema["additionalProperties"] is False, tool["name"]
                assert set(schema["required"]) <= set(schema["properties"]), tool["name"]


def check_openai(url):
    import copy

    import openai.lib._pydantic as strict
    from openai.types.chat import ChatCompletionFunctionToolParam
    from openai.types.responses import FunctionToolParam
    from pydantic import TypeAdapter

    tools = read(f"{url}/v1/tools?format=openai")
    TypeAdapter(list[FunctionToolParam]).validate_python(tools, strict=True)
    check_keywords(strict_ones(tools), "parameters")
    for tool in strict_ones(tools):
        for schema in schemas(tool["parameters"]):
            assert list(schema.get("properties", {})) == schema.get("required", []), tool["name"]
        made_strict = strict._ensure_strict_json_schema(copy.deepcopy(tool["parameters"]), path=(), root={})
        assert made_strict == tool["parameters"], tool["name"]
    chat = read(f"{url}/v1/tools?format=openai-chat")
    TypeAdapter(list[ChatCompletionFunctionToolParam]).validate_python(chat, strict=True)
    assert [tool["function"]["parameters"] for tool in chat] == [tool["parameters"] for tool in tools]


def check_anthropic(url):
    from anthropic import transform_schema
    from anthropic.types import ToolParam
    from pydantic import TypeAdapter

    tools = read(f"{url}/v1/tools?format=anthropic")
    TypeAdapter(list[ToolParam]).validate_python(tools, strict=True)
    tools = strict_ones(tools)
    check_keywords(tools, "input_schema")
    every = [schema for tool in tools for schema in schemas(tool["input_schema"])]
    optional = sum(len(schema.get("properties", {})) - len(schema.get("required", [])) for schema in every)
    unions = sum("anyOf" in schema for schema in every)
    assert len(tools) <= 20 and optional <= 24 and unions <= 16, (len(tools), optional, unions)
    for tool in tools:
        # What the SDK would have to change, the host would refuse.
        schema = tool["input_schema"]
        for enum in (inner for inner in schemas(schema) if "enum" in inner):
            del enum["type"]  # which an enum of texts need not have
        assert transform_schema(schema) == schema, tool["name"]
    print(f"    {len(tools)} strict tools, {optional} optional fields, {unions} unions")


def check_openapi(url):
    from openapi_spec_validator import OpenAPIV31SpecValidator

    document = read(f"{url}/v1/openapi.json")
    OpenAPIV31SpecValidator(document).validate()
    with urllib.request.urlopen(urllib.request.Request(f"{url}/docs", headers={"accept": "text/html"})) as page:
        text = page.read().decode()
    for path in document["paths"].values():
        for method in (method for name, method in path.items() if name != "parameters"):
            assert f'id="{method["operationId"]}"' in text, method["operationId"]


def field(value, *names):
    """An attribute whose name differs between the two major versions of the SDK."""
    return next(getattr(value, name) for name in names if hasattr(value, name))


# Results are structured, too, at the second; clients check them against the output schemas.
MCP_PATHS = ("/mcp", "/mcp?output=structured")


async def play(path, list_tools, call, get_prompt, mcp_error):
    """Plays the same episode by any client."""
    tools = {tool.name: tool for tool in (await list_tools()).tools}
    hints = tools["observe"].annotations
    assert field(hints, "readOnlyHint", "read_only_hint") is True, hints
    # A hint that is left out is false.
    assert not field(tools["wait"].annotations, "readOnlyHint", "read_only_hint")
    started = json.loads((await call("start_episode", PLAY)).content[0].text)
    episode = {"episode_id": started["episode_id"]}
    look = await call("observe", {**episode, "short": True})
    kinds = [block.type for block in look.content]
    assert kinds == ["text", "text", "image", "image"], kinds
    assert look.content[1].text == "2 images follow. Image 1: A. Image 2: B.", look.content[1]
    moved = await call("move_wrists", {**episode, "steps": 2, "robots": [{"robot": "A", "right_position_m": [0.3, -0.2, 0.1]}]})
    told = json.loads(moved.content[0].text)
    assert told["executed_steps"] == 2, moved
    assert field(moved, "structuredContent", "structured_content") == (told if "structured" in path else None), moved
    refused = await call("wait", {**episode, "steps": 0})
    assert field(refused, "isError", "is_error") and "at least 1" in refused.content[0].text, refused
    prompt = await get_prompt("play_task", {"task": "handover", "seed": "3"})
    assert "seed 3" in prompt.messages[0].content.text, prompt
    for asked in (call("grasp", {}), get_prompt("nod", {})):
        try:
            await asked
        except mcp_error as error:
            assert error.error.code == -32602, error.error
        else:
            raise AssertionError("not refused")
    await call("finish", episode)


async def check_mcp_1(url):
    from mcp import ClientSession, McpError
    from mcp.client.streamable_http import streamablehttp_client

    for path in MCP_PATHS:
        async with streamablehttp_client(url + path) as (read_stream, write_stream, _), ClientSession(read_stream, write_stream) as session:
            told = await session.initialize()
            print(f"    revision {told.protocolVersion}")
            await play(path, session.list_tools, session.call_tool, session.get_prompt, McpError)


async def check_mcp_2(url):
    from mcp import Client, MCPError

    for mode, path in itertools.product(("auto", "legacy"), MCP_PATHS):
        async with Client(url + path, mode=mode) as client:
            print(f"    revision {client.protocol_version}")
            await play(path, client.list_tools, client.call_tool, client.get_prompt, MCPError)


def check_mcp(url):
    from importlib.metadata import version

    print(f"    mcp {version('mcp')}")
    asyncio.run((check_mcp_1 if version("mcp").startswith("1.") else check_mcp_2)(url))


def check_inspector(url):
    def ask(*args):
        command = [*INSPECTOR, "--cli", f"{url}/mcp", "--transport", "http", *args]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr or done.stdout
        return json.loads(done.stdout[done.stdout.index("{"):])

    def call(tool, **args):
        given = [f"{name}={value if isinstance(value, str) else json.dumps(value)}" for name, value in args.items()]
        answer = ask("--method", "tools/call", "--tool-name", tool, *(part for pair in given for part in ("--tool-arg", pair)))
        assert not answer.get("isError"), answer
        return answer["content"]

    assert len(ask("--method", "tools/list")["tools"]) == len(read(f"{url}/v1/tools"))
    assert ask("--method", "prompts/list")["prompts"][0]["name"] == "play_task"
    episode = json.loads(call("start_episode", **PLAY)[0]["text"])["episode_id"]
    assert call("observe", episode_id=episode, robots=["B"], short=True)[2]["type"] == "image"
    depth = json.loads(call("query_depth", episode_id=episode, robot="A", pixels=[[160, 120]])[0]["text"])
    assert len(depth["points"]) == 1, depth
    reach = call("check_reach", episode_id=episode, robot="A", right_position_m=[0.3, -0.2, 0.1])
    assert "reachable" in json.loads(reach[0]["text"]), reach
    call("move_wrists", episode_id=episode, steps=1, robots=[{"robot": "A", "carried": True}])
    call("finish", episode_id=episode)


CHECKS = [
    ("openapi_spec_validator", check_openapi),
    ("openai", check_openai),
    ("anthropic", check_anthropic),
    ("mcp", check_mcp),
]


def main(url):
    failed = []
    checks = [(check, importlib.util.find_spec(module), module) for module, check in CHECKS]
    checks.append((check_inspector, shutil.which(INSPECTOR[0]), INSPECTOR[0]))
    for check, installed, module in checks:
        name = check.__name__.removeprefix("check_")
        if not installed:
            print(f"{name:12} left out: {module} is not installed")
            continue
        try:
            check(url)
            print(f"{name:12} fine")
        except Exception as error:
            failed.append(name)
            print(f"{name:12} FAILED: {type(error).__name__}: {error}")
    return not failed


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1]) else 1)
