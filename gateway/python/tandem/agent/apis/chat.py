"""OpenAI's Chat Completions, which Ollama, vLLM and most other model servers also offer."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from typing import Any

from ..conversation import Answers, Call, Picture, Reply, Told, Turn, Usage, listed
from ..settings import AgentSettings
from ..tools import Tool, for_chat
from .endpoint import EndpointError, OptionalFields, import_sdk, open_client, request, understood

RETURNED = ("reasoning_content", "reasoning_details")
"""Reasoning fields that some servers want back with the calls, by the servers' names for them."""

NOTHING = "(no words)"
"""Placeholder for a reply without text, because endpoints require some."""


class ChatModel:
    """A model behind Chat Completions."""

    def __init__(self, settings: AgentSettings, cache_key: str) -> None:
        self._sdk = import_sdk("openai")
        self._settings = settings
        self._client = open_client(self._sdk, self._sdk.OpenAI, settings, ["OPENAI_API_KEY"])
        self._sampling = settings.sampling.fields("openai-chat")
        self._optional = OptionalFields(RETURNED, prompt_cache_key=cache_key, reasoning_effort=settings.effort)

    def ask(self, instructions: str, tools: Sequence[Tool], turns: Sequence[Turn]) -> Reply:
        """Implements `Model.ask`."""

        def send(**optional: Any) -> Any:
            messages = [{"role": "system", "content": instructions}]
            messages += [message for turn in turns for message in _messages(turn, self._optional.returned)]
            return self._client.chat.completions.with_raw_response.create(
                model=self._settings.model, messages=messages, tools=for_chat(tools), **self._sampling, **optional
            )

        completion, retries = request(self._sdk, self._settings, self._optional, send)
        if not getattr(completion, "choices", None):
            raise EndpointError(f"{self._settings.model} answers without a choice: {str(completion)[:300]}")
        return understood(self._settings, retries, lambda: _reply(completion, len(turns)))


def _messages(turn: Turn, returned: Collection[str]) -> list[dict[str, Any]]:
    match turn:
        case Told(text):
            return [{"role": "user", "content": text}]
        case Reply():
            return [{name: value for name, value in turn.as_sent.items() if name not in RETURNED or name in returned}]
        case Answers(answers):
            told = [{"role": "tool", "tool_call_id": answer.call.call_id, "content": answer.text} for answer in answers]
            # Answers are text only in this API, so images follow in a message of the user.
            shown = [part for answer in answers for picture in answer.pictures for part in _picture(picture)]
            return [*told, {"role": "user", "content": shown}] if shown else told


def _picture(picture: Picture) -> list[dict[str, Any]]:
    url = f"data:image/png;base64,{picture.png_base64}"
    return [{"type": "text", "text": picture.caption}, {"type": "image_url", "image_url": {"url": url}}]


def _reply(completion: Any, turn: int) -> Reply:
    choice = completion.choices[0]
    message = choice.message
    words = message.content or ""
    asked = [call for call in listed(message.tool_calls) if call.type == "function"]
    # Some servers leave the id empty.
    calls = tuple(
        Call(call.id or f"call_{turn}_{index}", call.function.name, _text(call.function.arguments))
        for index, call in enumerate(asked)
    )
    as_sent: dict[str, Any] = {"role": "assistant", "content": words or (None if calls else NOTHING)}
    as_sent |= {name: value for name in RETURNED if (value := getattr(message, name, None))}
    if calls:
        as_sent["tool_calls"] = [_sent(call, raw) for call, raw in zip(calls, asked, strict=True)]
    thoughts = getattr(message, "reasoning_content", None) or getattr(message, "reasoning", None) or ""
    refusal = getattr(message, "refusal", None) or None
    cut, filtered = choice.finish_reason == "length", choice.finish_reason == "content_filter"
    return Reply(words, str(thoughts), calls, _usage(completion.usage), as_sent, cut, refusal, filtered)


def _text(arguments: Any) -> str:
    """Returns arguments as JSON; some servers send the object itself."""
    return arguments or "{}" if isinstance(arguments, str) else json.dumps(arguments or {})


def _sent(call: Call, raw: Any) -> dict[str, Any]:
    """Returns a call in the form for later requests, with all extra fields of its server. The arguments have to be
    JSON, because templates of local models parse them.
    """
    arguments = call.arguments if _is_object(call.arguments) else "{}"
    function = {"name": call.tool, "arguments": arguments}
    return {**raw.model_dump(exclude_none=True, mode="json"), "id": call.call_id, "function": function}


def _is_object(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except ValueError:
        return False


def _usage(usage: Any) -> Usage | None:
    if usage is None:
        return None
    details = usage.prompt_tokens_details
    cached = (getattr(details, "cached_tokens", None) or 0) if details else 0
    written = (getattr(details, "cache_write_tokens", None) or 0) if details else 0
    return Usage(usage.prompt_tokens or 0, usage.completion_tokens or 0, cached, written)
