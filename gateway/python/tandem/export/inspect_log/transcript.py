"""Events of a conversation in Inspect's form."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

from inspect_ai.event import CompactionEvent, Event, InfoEvent, ModelEvent, SpanBeginEvent, SpanEndEvent, ToolEvent
from inspect_ai.model import ChatCompletionChoice, ChatMessage, GenerateConfig, ModelOutput, ModelUsage, StopReason
from inspect_ai.tool import ToolInfo, ToolParams

from ...agent.conversation import Reply, Told, Usage
from ...agent.instructions import OPENING
from ...agent.journal import Answered, Halved, Progress, Replied, Resumed
from ...agent.settings import AgentSettings
from ...agent.tools import Tool
from .episodes import Conversation, time_of
from .messages import Messages, arguments_of, content_of, error_of

SOURCE = "tandem"
"""Source of events that Inspect has no kind for."""


class Transcript:
    """Messages and events of one conversation, with the sums of its usage. The conversation is replayed, so that every
    model event has the messages that were sent: without old images, and without the dropped half of a long
    conversation.
    """

    def __init__(self, conversation: Conversation) -> None:
        begun = conversation.begun
        self._conversation = conversation
        self._robot = conversation.robot
        self._model = conversation.model
        name = "" if self._robot is None else f"{self._robot}-"
        self._span = f"{name}agent"
        self._making = Messages(name, self._robot, self._model, begun.instructions)
        self._tools = [_tool(tool) for tool in begun.tools]
        self._config = config_of(conversation.settings)
        self._progress = Progress(AgentSettings(self._model), OPENING)
        self._began = conversation.begun_at
        self._seconds = 0.0
        self.messages: list[ChatMessage] = [self._making.system, *self._making.of(self._progress.memory.turns[0])]
        """All messages, including those that were dropped later."""

        self.output = ModelOutput(model=self._model)
        """Last reply."""

        self.usage = ModelUsage()
        begin = SpanBeginEvent(id=self._span, type="agent", name=self._robot or "agent", **self._at(0.0, span=False))
        self.events: list[Event] = [begin]
        for event in conversation.events:
            self._add(event)
        self.events.append(SpanEndEvent(id=self._span, **self._at(self._seconds, span=False)))

    @property
    def ended_at(self) -> datetime:
        """Time of the last event."""
        return self._time(self._seconds)

    @property
    def seconds(self) -> float:
        """Playing time, without gaps between processes."""
        return self._seconds

    def _add(self, event: Any) -> None:
        progress = self._progress
        match event:
            case Replied():
                self._add_reply(event)
            case Answered():
                self._add_answer(event)
            case Told():
                self.messages += self._making.of(event)
            case Resumed():
                # Time between processes does not count as the agent's.
                self._began = time_of(event.at) - timedelta(seconds=self._seconds)
                self._tell("taken up again by another process")
            case Halved():
                self._compact()
            case _:
                pass
        progress.apply(event)

    def _add_reply(self, event: Replied) -> None:
        reply, began_s = event.reply, max(event.seconds - event.model_s, 0.0)
        sent = [self._making.system, *(message for turn in self._progress.memory.turns for message in self._making.of(turn))]
        for index, call in enumerate(reply.calls):
            self._making.name_call(call, self._progress.ledger.requests + 1, index)
        (message,) = self._making.of(reply)
        usage = _usage(event.usage, event.usd)
        estimated = {"tokens_estimated": True} if reply.usage is None else None
        choice = ChatCompletionChoice.model_validate({"message": message, "stop_reason": _stop_reason(reply)})
        self.output = ModelOutput(
            model=self._model, choices=[choice], usage=usage, time=event.model_s, metadata=estimated, error=reply.refusal
        )
        self.usage += usage
        self.messages.append(message)
        self._seconds = event.seconds
        self.events.append(
            ModelEvent(
                model=self._model,
                role=self._robot,
                input=sent,
                tools=self._tools,
                tool_choice="auto",
                config=self._config,
                output=self.output,
                retries=reply.retries or None,
                completed=self._time(event.seconds),
                working_time=event.model_s,
                **self._at(began_s),
            )
        )
        if event.halves:
            self._compact()

    def _add_answer(self, event: Answered) -> None:
        answer, began_s = event.answer, self._seconds
        index = len(self._progress.answered)
        call_id = self._making.name_call(answer.call, self._progress.ledger.requests, index)
        (message,) = self._making.of_answer(answer)
        self.messages.append(message)
        self._seconds = event.seconds
        self.events.append(
            ToolEvent(
                id=call_id,
                function=answer.call.tool,
                arguments=arguments_of(answer.call)[0],
                result=content_of(answer),
                error=error_of(answer),
                completed=self._time(event.seconds),
                working_time=event.seconds - began_s,
                message_id=message.id,
                metadata=None if event.called else {"called": False},
                **self._at(began_s),
            )
        )
        for phase in event.phases[len(self._progress.phases) :]:
            self._tell(f"reached: {phase}")

    def _compact(self) -> None:
        self.events.append(CompactionEvent(type="trim", role=self._robot, source=SOURCE, **self._at(self._seconds)))

    def _tell(self, text: str) -> None:
        self.events.append(InfoEvent(source=SOURCE, data=text, **self._at(self._seconds)))

    def _time(self, seconds: float) -> datetime:
        return self._began + timedelta(seconds=seconds)

    def _at(self, seconds: float, *, span: bool = True) -> dict[str, Any]:
        """Returns the common fields of an event."""
        placed: dict[str, Any] = {"timestamp": self._time(seconds), "working_start": seconds}
        return {**placed, "span_id": self._span} if span else placed


def config_of(settings: dict[str, Any]) -> GenerateConfig:
    """Returns the sampling parameters of a model."""
    sampling: dict[str, Any] = settings.get("sampling", {})
    names = ("temperature", "top_p", "seed", "extra_body")
    return GenerateConfig.model_validate({name: sampling[name] for name in names if name in sampling})


def _stop_reason(reply: Reply) -> StopReason:
    if reply.cut:
        return "max_tokens"
    if reply.filtered or reply.refusal is not None:
        return "content_filter"
    return "tool_calls" if reply.calls else "stop"


def _usage(usage: Usage, usd: float | None) -> ModelUsage:
    return ModelUsage(
        input_tokens=usage.input - usage.cached - usage.cache_written,
        output_tokens=usage.output,
        total_tokens=usage.input + usage.output,
        input_tokens_cache_read=usage.cached,
        input_tokens_cache_write=usage.cache_written,
        total_cost=usd,
    )


def _tool(tool: Tool) -> ToolInfo:
    return ToolInfo(name=tool.name, description=tool.description, parameters=ToolParams.model_validate(tool.schema))
