"""Anthropic's Messages."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from ..conversation import Answer, Answers, Call, Picture, Reply, Told, Turn, Usage
from ..settings import AgentSettings
from ..tools import Tool, for_messages
from .chat import NOTHING
from .endpoint import OptionalFields, import_sdk, open_client, request, understood

REPLY_TOKENS = 16_000
"""Maximum number of tokens of a reply, reasoning included; this API requires a limit."""

CACHED = {"cache_control": {"type": "ephemeral"}}
"""Cache marker: the endpoint caches everything up to it. Four are allowed: tools, instructions, and the latest two
of our turns. The earlier of the two turns is the one that the last request has cached.
"""
CACHED_TURNS = 2


class MessagesModel:
    """A model behind Messages."""

    def __init__(self, settings: AgentSettings) -> None:
        self._sdk = import_sdk("anthropic")
        self._settings = settings
        self._client = open_client(self._sdk, self._sdk.Anthropic, settings, ["ANTHROPIC_API_KEY", "ANTHROPIC_AUTH_TOKEN"])
        self._sampling = settings.sampling.fields("anthropic")
        thinking = settings.effort is not None
        self._optional = OptionalFields(
            output_config={"effort": settings.effort} if thinking else None,
            thinking={"type": "adaptive", "display": "summarized"} if thinking else None,
        )

    def ask(self, instructions: str, tools: Sequence[Tool], turns: Sequence[Turn]) -> Reply:
        """Implements `Model.ask`."""
        offered = for_messages(tools)
        offered[-1] |= CACHED
        messages = [_message(turn) for turn in turns]
        for message in [message for message in messages if message["role"] == "user"][-CACHED_TURNS:]:
            message["content"][-1] |= CACHED

        def send(**optional: Any) -> Any:
            return self._client.messages.with_raw_response.create(
                model=self._settings.model,
                max_tokens=REPLY_TOKENS,
                system=[{"type": "text", "text": instructions, **CACHED}],
                messages=messages,
                tools=offered,
                **self._sampling,
                **optional,
            )

        message, retries = request(self._sdk, self._settings, self._optional, send)
        return understood(self._settings, retries, lambda: _reply(message))


def _message(turn: Turn) -> dict[str, Any]:
    match turn:
        case Told(text):
            return {"role": "user", "content": [{"type": "text", "text": text}]}
        case Reply():
            return {"role": "assistant", "content": turn.as_sent}
        case Answers(answers):
            return {"role": "user", "content": [_result(answer) for answer in answers]}


def _result(answer: Answer) -> dict[str, Any]:
    content = [{"type": "text", "text": answer.text}, *(part for picture in answer.pictures for part in _picture(picture))]
    return {"type": "tool_result", "tool_use_id": answer.call.call_id, "content": content, "is_error": answer.refused}


def _picture(picture: Picture) -> list[dict[str, Any]]:
    source = {"type": "base64", "media_type": "image/png", "data": picture.png_base64}
    return [{"type": "text", "text": picture.caption}, {"type": "image", "source": source}]


def _reply(message: Any) -> Reply:
    words = "\n".join(block.text for block in message.content if block.type == "text")
    thoughts = "\n".join(block.thinking for block in message.content if block.type == "thinking")
    calls = tuple(Call(block.id, block.name, json.dumps(block.input)) for block in message.content if block.type == "tool_use")
    as_sent = [block.model_dump(exclude_none=True, mode="json") for block in message.content]
    usage = message.usage
    cached, written = usage.cache_read_input_tokens or 0, usage.cache_creation_input_tokens or 0
    counted = Usage(usage.input_tokens + cached + written, usage.output_tokens, cached, written)
    sent = as_sent or [{"type": "text", "text": NOTHING}]
    refusal = (words or NOTHING) if message.stop_reason == "refusal" else None
    return Reply(words, thoughts, calls, counted, sent, message.stop_reason == "max_tokens", refusal)
