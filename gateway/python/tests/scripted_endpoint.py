"""A server of models whose replies follow a script, in the wire formats of OpenAI and Anthropic. It stores the requests."""

from __future__ import annotations

import base64
import json
import threading
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any, TypeAlias, cast

from anthropic.types.message_create_params import MessageCreateParamsNonStreaming
from openai.types.chat.completion_create_params import CompletionCreateParamsNonStreaming
from openai.types.responses.response_create_params import ResponseCreateParamsNonStreaming
from pydantic import TypeAdapter

# Types that the SDKs accept, by their own descriptions.
BODIES: dict[str, TypeAdapter[Any]] = {
    "/v1/chat/completions": TypeAdapter(CompletionCreateParamsNonStreaming),
    "/v1/responses": TypeAdapter(ResponseCreateParamsNonStreaming),
    "/v1/messages": TypeAdapter(MessageCreateParamsNonStreaming),
}

PNG = b"\x89PNG\r\n\x1a\n"

INPUT_TOKENS, CACHED_TOKENS, OUTPUT_TOKENS = 1000, 400, 50
"""Token usage in every reply."""


BESIDE: dict[str, Any] = {"extra_content": {"google": {"thought_signature": "signed"}}}
"""Extra field of each call that the server of Chat Completions requires back, like Gemini's."""


@dataclass(frozen=True)
class Says:
    """A reply of the scripted model: a text, and tools with their arguments. Arguments given as a text are sent unchanged."""

    words: str = ""
    calls: tuple[tuple[str, dict[str, Any] | str], ...] = ()
    thoughts: str = ""
    cut: bool = False
    refusal: str = ""
    """Text of the model's refusal."""
    filtered: bool = False
    """True if a filter withholds the reply, in formats with filters."""


@dataclass(frozen=True)
class Heard:
    """The answer to a call of the scripted model."""

    call_id: str
    text: str
    pictures: int
    refused: bool | None
    """None if the format does not contain it."""


Script: TypeAlias = Generator[Says, list[Heard], None]


@dataclass(frozen=True)
class Refusal:
    """A status that replaces a reply."""

    status: int
    message: str
    param: str | None = None


@dataclass(frozen=True)
class Request:
    """The requests."""

    path: str
    body: dict[str, Any]
    system: str
    pictures: int
    headers: dict[str, str]


@dataclass
class Conversation:
    """A script during its conversation."""

    script: Script
    began: bool = False
    sent_ids: list[str] = field(default_factory=list[str])
    latest: tuple[dict[str, Any], dict[str, Any]] | None = None
    """The latest request and its reply, which is repeated if the request is."""


class ScriptedEndpoint:
    """The server. Each conversation has its own script; its instructions identify it.

    refusals: What is answered first, one a request.
    unknown: Fields that are refused, as an older server does.
    """

    def __init__(self, script: Callable[[str], Script], refusals: Iterable[Refusal] = (), unknown: Iterable[str] = ()) -> None:
        self.requests: list[Request] = []
        self.refused: list[int] = []
        self._script = script
        self._refusals = list(refusals)
        self._unknown = tuple(unknown)
        self._conversations: dict[str, Conversation] = {}
        self._lock = threading.Lock()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())

    def __enter__(self) -> ScriptedEndpoint:
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._server.shutdown()
        self._server.server_close()

    def restart(self) -> None:
        """Forgets all conversations."""
        self._conversations.clear()

    def base_url(self, api: str) -> str:
        """The address for an SDK."""
        root = f"http://127.0.0.1:{self._server.server_port}"
        return root if api == "anthropic" else f"{root}/v1"

    def answer(self, path: str, body: dict[str, Any], headers: dict[str, str]) -> tuple[int, dict[str, Any]]:
        """The status and the body of a reply."""
        with self._lock:
            refusal = self._refusals.pop(0) if self._refusals else None
            if refusal is None:
                named = next((name for name in self._unknown if name in body), None)
                refusal = Refusal(400, f"Unrecognized request argument supplied: {named}", named) if named else None
            if refusal is not None:
                self.refused.append(refusal.status)
                return refusal.status, _error(path, refusal)
            check_all(BODIES[path].validate_python(body))
            wire = WIRES[path]
            system = wire.system(body)
            conversation = self._conversations.setdefault(system, Conversation(self._script(system)))
            if conversation.latest is not None and conversation.latest[0] == body:
                return 200, conversation.latest[1]
            self.requests.append(Request(path, body, system, _count_pictures(body), headers))
            heard = wire.heard(body)
            answered = [each.call_id for each in heard]
            assert answered == conversation.sent_ids, f"calls {conversation.sent_ids} were answered as {answered}"
            said = conversation.script.send(heard) if conversation.began else next(conversation.script)
            conversation.began = True
            ids = [f"call_{len(self.requests)}_{index}" for index in range(len(said.calls))]
            reply = wire.reply(said, ids)
            conversation.sent_ids = ids
            conversation.latest = (body, reply)
            return 200, reply

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        endpoint = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self) -> None:
                body = json.loads(self.rfile.read(int(self.headers["content-length"])))
                try:
                    status, reply = endpoint.answer(
                        self.path, body, {name.lower(): value for name, value in self.headers.items()}
                    )
                except Exception as error:
                    # This is not a status after which an SDK repeats its request.
                    status, reply = 418, {"error": {"message": f"{type(error).__name__}: {error}", "type": "test"}}
                content = json.dumps(reply).encode()
                self.send_response(status)
                self.send_header("content-type", "application/json")
                self.send_header("content-length", str(len(content)))
                self.send_header("retry-after-ms", "1")
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        return Handler


def check_all(value: Any) -> None:
    """Checks values that pydantic checks lazily, such as iterables."""
    if isinstance(value, dict):
        for each in cast("dict[str, Any]", value).values():
            check_all(each)
    elif not isinstance(value, str | int | float | None):
        for each in value:
            check_all(each)


def _error(path: str, refusal: Refusal) -> dict[str, Any]:
    error = {"type": "invalid_request_error", "message": refusal.message}
    return (
        {"type": "error", "error": error}
        if path == "/v1/messages"
        else {"error": {**error, "param": refusal.param, "code": None}}
    )


def _count_pictures(value: Any) -> int:
    """Images anywhere in a body. Each has to be a PNG file."""
    if isinstance(value, dict):
        fields = cast("dict[str, Any]", value)
        if fields.get("type") in ("image", "input_image", "image_url"):
            source = fields.get("source") or fields["image_url"]
            text = source if isinstance(source, str) else source.get("data") or source["url"]
            assert base64.b64decode(str(text).removeprefix("data:image/png;base64,")).startswith(PNG)
            return 1
        return sum(_count_pictures(each) for each in fields.values())
    if isinstance(value, list):
        items = cast("list[Any]", value)
        return sum(_count_pictures(each) for each in items)
    return 0


def _texts(content: Any) -> str:
    if isinstance(content, str):
        return content
    return "\n".join(str(part["text"]) for part in content if part["type"] in ("text", "input_text"))


class Chat:
    """OpenAI's Chat Completions."""

    def system(self, body: dict[str, Any]) -> str:
        assert body["messages"][0]["role"] == "system"
        return body["messages"][0]["content"]

    def heard(self, body: dict[str, Any]) -> list[Heard]:
        since = _since_assistant(body["messages"])
        shown = sum(_count_pictures(message) for message in since if message["role"] == "user")
        told = [message for message in since if message["role"] == "tool"]
        return [
            Heard(message["tool_call_id"], message["content"], shown if index == len(told) - 1 else 0, None)
            for index, message in enumerate(told)
        ]

    def reply(self, said: Says, ids: list[str]) -> dict[str, Any]:
        calls = [
            {**BESIDE, "id": call_id, "type": "function", "function": {"name": name, "arguments": _json(arguments)}}
            for call_id, (name, arguments) in zip(ids, said.calls, strict=True)
        ]
        message: dict[str, Any] = {"role": "assistant", "content": said.words or None}
        if calls:
            message["tool_calls"] = calls
        if said.thoughts:
            message["reasoning_content"] = said.thoughts
        if said.refusal:
            message["refusal"] = said.refusal
        reason = "length" if said.cut else "content_filter" if said.filtered else "tool_calls" if calls else "stop"
        choice = {"index": 0, "message": message, "finish_reason": reason, "logprobs": None}
        usage = {
            "prompt_tokens": INPUT_TOKENS,
            "completion_tokens": OUTPUT_TOKENS,
            "total_tokens": INPUT_TOKENS + OUTPUT_TOKENS,
            "prompt_tokens_details": {"cached_tokens": CACHED_TOKENS},
        }
        return {"id": "c", "object": "chat.completion", "created": 0, "model": "m", "choices": [choice], "usage": usage}


class Responses:
    """OpenAI's Responses."""

    def system(self, body: dict[str, Any]) -> str:
        assert body["input"][0]["role"] == "user"
        return body["instructions"]

    def heard(self, body: dict[str, Any]) -> list[Heard]:
        told = [item for item in _trailing(body["input"], lambda item: item.get("type") == "function_call_output")]
        return [Heard(item["call_id"], _texts(item["output"]), _count_pictures(item), None) for item in told]

    def reply(self, said: Says, ids: list[str]) -> dict[str, Any]:
        output: list[dict[str, Any]] = []
        if said.thoughts:
            summary = [{"type": "summary_text", "text": said.thoughts}]
            output.append({"type": "reasoning", "id": "rs", "summary": summary, "encrypted_content": "sealed"})
        if said.words:
            content: list[dict[str, Any]] = [{"type": "output_text", "text": said.words, "annotations": []}]
            output.append({"type": "message", "id": "msg", "role": "assistant", "status": "completed", "content": content})
        if said.refusal:
            refusal = [{"type": "refusal", "refusal": said.refusal}]
            output.append({"type": "message", "id": "msg", "role": "assistant", "status": "completed", "content": refusal})
        for call_id, (name, arguments) in zip(ids, said.calls, strict=True):
            call = {"type": "function_call", "id": f"fc_{call_id}", "call_id": call_id, "name": name}
            output.append({**call, "arguments": _json(arguments), "status": "completed"})
        usage = {
            "input_tokens": INPUT_TOKENS,
            "input_tokens_details": {"cached_tokens": CACHED_TOKENS},
            "output_tokens": OUTPUT_TOKENS,
            "output_tokens_details": {"reasoning_tokens": 0},
            "total_tokens": INPUT_TOKENS + OUTPUT_TOKENS,
        }
        reason = "max_output_tokens" if said.cut else "content_filter" if said.filtered else None
        status = {"status": "completed" if reason is None else "incomplete"}
        cut = {"incomplete_details": None if reason is None else {"reason": reason}}
        return {
            "id": "r",
            "object": "response",
            "created_at": 0,
            "model": "m",
            "output": output,
            "usage": usage,
            **status,
            **cut,
        }


class Messages:
    """Anthropic's Messages."""

    def system(self, body: dict[str, Any]) -> str:
        assert body["messages"][0]["role"] == "user"
        assert isinstance(body["max_tokens"], int)
        return body["system"][0]["text"]

    def heard(self, body: dict[str, Any]) -> list[Heard]:
        last = body["messages"][-1]
        assert last["role"] == "user"
        results = [block for block in last["content"] if block["type"] == "tool_result"]
        return [
            Heard(block["tool_use_id"], _texts(block["content"]), _count_pictures(block), block["is_error"])
            for block in results
        ]

    def reply(self, said: Says, ids: list[str]) -> dict[str, Any]:
        content: list[dict[str, Any]] = []
        if said.thoughts:
            content.append({"type": "thinking", "thinking": said.thoughts, "signature": "signed"})
        if said.words or said.refusal:
            content.append({"type": "text", "text": said.words or said.refusal})
        for call_id, (name, arguments) in zip(ids, said.calls, strict=True):
            content.append({"type": "tool_use", "id": call_id, "name": name, "input": arguments})
        reason = "max_tokens" if said.cut else "refusal" if said.refusal else "tool_use" if said.calls else "end_turn"
        usage = {
            "input_tokens": INPUT_TOKENS - CACHED_TOKENS,
            "cache_read_input_tokens": CACHED_TOKENS,
            "cache_creation_input_tokens": 0,
            "output_tokens": OUTPUT_TOKENS,
        }
        reply = {"id": "m", "type": "message", "role": "assistant", "model": "m", "content": content, "usage": usage}
        return {**reply, "stop_reason": reason, "stop_sequence": None}


WIRES: dict[str, Chat | Responses | Messages] = {
    "/v1/chat/completions": Chat(),
    "/v1/responses": Responses(),
    "/v1/messages": Messages(),
}


def _json(arguments: dict[str, Any] | str) -> str:
    return arguments if isinstance(arguments, str) else json.dumps(arguments)


def _trailing(items: list[dict[str, Any]], belongs: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
    first = len(items)
    while first > 0 and belongs(items[first - 1]):
        first -= 1
    return items[first:]


def _since_assistant(messages: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return _trailing(messages, lambda message: message["role"] != "assistant")
