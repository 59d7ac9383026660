"""Choice of the adapter for an endpoint."""

from __future__ import annotations

from ..settings import AgentSettings
from .chat import ChatModel
from .endpoint import Model
from .messages import MessagesModel
from .responses import ResponsesModel


def open_model(settings: AgentSettings, cache_key: str) -> Model:
    """Creates the model of these settings; no request is made yet.

    Args:
        cache_key: Common key of conversations with the same beginning, for endpoints that cache by it.
    """
    match settings.api:
        case "openai":
            return ResponsesModel(settings, cache_key)
        case "openai-chat":
            return ChatModel(settings, cache_key)
        case "anthropic":
            return MessagesModel(settings)
