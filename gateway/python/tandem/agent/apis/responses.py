"""OpenAI's Responses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..conversation import Answer, Answers, Call, Reply, Told, Turn, Usage, listed
from ..settings import AgentSettings
from ..tools import Tool, for_responses
from .chat import NOTHING
from .endpoint import EndpointError, OptionalFields, import_sdk, open_client, request, understood


class ResponsesModel:
    """A model behind Responses. Nothing is stored there: the whole conversation is sent, with reasoning as
    received.
    """

    def __init__(self, settings: AgentSettings, cache_key: str) -> None:
        self._sdk = import_sdk("openai")
        self._settings = settings
        self._client = open_client(self._sdk, self._sdk.OpenAI, settings, ["OPENAI_API_KEY"])
        self._sampling = settings.sampling.fields("openai")
        self._optional = OptionalFields(
            prompt_cache_key=cache_key,
            store=False,
            include=["reasoning.encrypted_content"],
            reasoning={"effort": settings.effort, "summary": "auto"} if settings.effort else None,
        )

    def ask(self, instructions: str, tools: Sequence[Tool], turns: Sequence[Turn]) -> Reply:
        """Implements `Model.ask`."""
        items = [item for turn in turns for item in _items(turn)]

        def send(**optional: Any) -> Any:
            return self._client.responses.with_raw_response.create(
                model=self._settings.model,
                instructions=instructions,
                input=items,
                tools=for_responses(tools),
                **self._sampling,
                **optional,
            )

        response, retries = request(self._sdk, self._settings, self._optional, send)
        if getattr(response, "status", None) == "failed":
            raise EndpointError(f"{self._settings.model} failed: {response.error}")
        return understood(self._settings, retries, lambda: _reply(response))


def _items(turn: Turn) -> list[dict[str, Any]]:
    match turn:
        case Told(text):
            return [{"role": "user", "content": text}]
        case Reply():
            return turn.as_sent
        case Answers(answers):
            return [
                {"type": "function_call_output", "call_id": answer.call.call_id, "output": _output(answer)}
                for answer in answers
            ]


def _output(answer: Answer) -> str | list[dict[str, Any]]:
    if not answer.pictures:
        return answer.text
    parts: list[dict[str, Any]] = [{"type": "input_text", "text": answer.text}]
    for picture in answer.pictures:
        url = f"data:image/png;base64,{picture.png_base64}"
        parts += [{"type": "input_text", "text": picture.caption}, {"type": "input_image", "image_url": url, "detail": "auto"}]
    return parts


def _reply(response: Any) -> Reply:
    calls: list[Call] = []
    thoughts: list[str] = []
    as_sent: list[dict[str, Any]] = []
    for item in response.output:
        if item.type == "function_call":
            calls.append(Call(item.call_id, item.name, item.arguments or "{}"))
        if item.type == "reasoning":
            thoughts += [str(part.text) for part in listed(item.summary) + listed(getattr(item, "content", None))]
            # Reasoning that is not stored there can only be sent back in its encrypted form.
            if not item.encrypted_content:
                continue
        as_sent.append(item.model_dump(exclude_none=True, mode="json"))
    incomplete = None if response.incomplete_details is None else response.incomplete_details.reason
    cut, filtered = incomplete == "max_output_tokens", incomplete == "content_filter"
    parts = [part for item in response.output if item.type == "message" for part in item.content]
    refusals = [str(part.refusal) for part in parts if part.type == "refusal"]
    refusal = "\n".join(refusals) if refusals else None
    sent = as_sent or [{"role": "assistant", "content": NOTHING}]
    return Reply(response.output_text, "\n".join(thoughts), tuple(calls), _usage(response.usage), sent, cut, refusal, filtered)


def _usage(usage: Any) -> Usage | None:
    if usage is None:
        return None
    details = usage.input_tokens_details
    cached = (getattr(details, "cached_tokens", None) or 0) if details else 0
    written = (getattr(details, "cache_write_tokens", None) or 0) if details else 0
    return Usage(usage.input_tokens, usage.output_tokens, cached, written)
