"""Which adapter speaks to an endpoint."""

from __future__ import annotations

from ..settings import AgentSettings
from .chat import ChatModel
from .endpoint import Model
from .messages import MessagesModel
from .responses import ResponsesModel


def open_model(settings: AgentSettings, cache_key: str) -> Model:
    """The model of these settings; nothing is asked yet.

    cache_key: What conversations have in common that begin alike, for endpoints that keep what they have read by it.
    """
    match settings.api:
        case "openai":
            return ResponsesModel(settings, cache_key)
        case "openai-chat":
            return ChatModel(settings, cache_key)
        case "anthropic":
            return MessagesModel(settings)
