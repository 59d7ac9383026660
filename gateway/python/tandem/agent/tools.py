"""The tools of an episode in the form of each API."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..client import Client

EPISODE_ID = "episode_id"


@dataclass(frozen=True)
class Tool:
    """A tool that the model may call."""

    name: str
    description: str
    schema: dict[str, Any]

    def takes(self, argument: str) -> bool:
        """Returns true if there is an argument of this name."""
        return argument in self.schema.get("properties", {})


def offered(client: Client, episode_id: str) -> tuple[Tool, ...]:
    """Returns the tools of this episode for this caller. The schemas are those for MCP, which are the shortest.
    Optional arguments may be left out, and the server's refusals explain what schemas do not.
    """
    names = {str(tool["name"]) for tool in client.request("GET", f"/v1/episodes/{episode_id}/tools")}
    specs = client.request("GET", "/v1/tools?format=mcp")
    return tuple(_tool(spec) for spec in specs if spec["name"] in names)


def _tool(spec: dict[str, Any]) -> Tool:
    """Returns a tool without its episode argument, because the model plays one episode."""
    schema = dict(spec["inputSchema"])
    schema["properties"] = {name: field for name, field in schema.get("properties", {}).items() if name != EPISODE_ID}
    schema["required"] = [name for name in schema.get("required", []) if name != EPISODE_ID]
    schema["examples"] = [
        {name: value for name, value in example.items() if name != EPISODE_ID} for example in schema.get("examples", [])
    ]
    if not schema["examples"]:
        del schema["examples"]
    return Tool(str(spec["name"]), str(spec["description"]), schema)


def for_chat(tools: Sequence[Tool]) -> list[dict[str, Any]]:
    """Returns the tools for OpenAI's Chat Completions."""
    return [{"type": "function", "function": _function(tool)} for tool in tools]


def for_responses(tools: Sequence[Tool]) -> list[dict[str, Any]]:
    """Returns the tools for OpenAI's Responses, which would be strict by default."""
    return [{"type": "function", **_function(tool), "strict": False} for tool in tools]


def for_messages(tools: Sequence[Tool]) -> list[dict[str, Any]]:
    """Returns the tools for Anthropic's Messages."""
    return [{"name": tool.name, "description": tool.description, "input_schema": tool.schema} for tool in tools]


def _function(tool: Tool) -> dict[str, Any]:
    return {"name": tool.name, "description": tool.description, "parameters": tool.schema}
