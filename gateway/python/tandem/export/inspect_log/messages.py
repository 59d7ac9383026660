"""Messages of a conversation in Inspect's form."""

from __future__ import annotations

import json
from typing import Any, cast

from inspect_ai.model import (
    ChatMessage,
    ChatMessageAssistant,
    ChatMessageSystem,
    ChatMessageTool,
    ChatMessageUser,
    Content,
    ContentImage,
    ContentReasoning,
    ContentText,
)
from inspect_ai.tool import ToolCall, ToolCallError

from ...agent.conversation import Answer, Answers, Call, Reply, Told, Turn


class Messages:
    """Messages of one conversation. A turn has the same messages whenever it is sent, so that logs have them once.

    name: Prefix of ids, which tells the conversations of an episode apart.
    """

    def __init__(self, name: str, robot: str | None, model: str, instructions: str) -> None:
        self._name = name
        self._model = model
        self._metadata = None if robot is None else {"robot": robot}
        self._made: dict[int, tuple[Any, list[ChatMessage]]] = {}
        self._call_ids: dict[int, str] = {}
        self._count = 0
        self.system = ChatMessageSystem(content=instructions, id=self._next_id(), metadata=self._metadata)

    def of(self, turn: Turn) -> list[ChatMessage]:
        """Returns the messages of a turn."""
        match turn:
            case Told(text):
                return self._once(turn, lambda: [ChatMessageUser(content=text, **self._common())])
            case Reply():
                return self._once(turn, lambda: [self._assistant(turn)])
            case Answers(answers):
                return [message for answer in answers for message in self.of_answer(answer)]

    def of_answer(self, answer: Answer) -> list[ChatMessage]:
        """Returns the message of an answer."""
        return self._once(answer, lambda: [self._tool(answer)])

    def name_call(self, call: Call, number: int, index: int) -> str:
        """Names the call at `index` of the reply `number`. Ids of endpoints may occur twice in an episode."""
        self._call_ids[id(call)] = call_id = f"{self._name}{number}-{index}"
        return call_id

    def _once(self, key: Any, make: Any) -> list[ChatMessage]:
        if id(key) not in self._made:
            # The key is kept, too, so that no other object gets its id.
            self._made[id(key)] = (key, make())
        return self._made[id(key)][1]

    def _common(self) -> dict[str, Any]:
        return {"id": self._next_id(), "metadata": self._metadata}

    def _next_id(self) -> str:
        self._count += 1
        return f"{self._name}message-{self._count}"

    def _assistant(self, reply: Reply) -> ChatMessageAssistant:
        content: list[Content] = []
        if reply.thoughts:
            content.append(ContentReasoning(reasoning=reply.thoughts))
        if reply.words:
            content.append(ContentText(text=reply.words))
        if reply.refusal is not None:
            content.append(ContentText(text=reply.refusal, refusal=True))
        calls = [self._call(call) for call in reply.calls]
        return ChatMessageAssistant(
            content=content, tool_calls=calls or None, model=self._model, source="generate", **self._common()
        )

    def _call(self, call: Call) -> ToolCall:
        arguments, problem = arguments_of(call)
        return ToolCall(self._call_ids[id(call)], call.tool, arguments, problem)

    def _tool(self, answer: Answer) -> ChatMessageTool:
        return ChatMessageTool(
            content=content_of(answer),
            tool_call_id=self._call_ids[id(answer.call)],
            function=answer.call.tool,
            error=error_of(answer),
            **self._common(),
        )


def arguments_of(call: Call) -> tuple[dict[str, Any], str | None]:
    """Returns the arguments of a call, and the problem if they are no JSON object."""
    try:
        given = json.loads(call.arguments or "{}")
    except ValueError as error:
        return {}, f"{error}: {call.arguments}"
    if not isinstance(given, dict):
        return {}, f"no object: {call.arguments}"
    return cast("dict[str, Any]", given), None


def content_of(answer: Answer) -> list[Any]:
    """Returns the text and the images of an answer, each image after its caption."""
    content: list[Content] = [ContentText(text=answer.text)]
    for picture in answer.pictures:
        content += [
            ContentText(text=picture.caption),
            ContentImage(image=f"data:image/png;base64,{picture.png_base64}"),
        ]
    return content


def error_of(answer: Answer) -> ToolCallError | None:
    """Returns the refusal of a call; None if it was executed."""
    return ToolCallError("unknown", answer.text) if answer.refused else None
