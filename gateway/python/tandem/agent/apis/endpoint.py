"""Common parts of the adapters: clients with their keys, optional fields, and errors."""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Protocol

from ...errors import TandemError
from ..conversation import Reply, Turn
from ..settings import AgentSettings
from ..tools import Tool

INSTALL = "pip install 'tandem-sim[agents]'"

RETRIES = 6
"""Number of retries of an SDK, with its own growing delays. They cover about half a minute of 429 and 500."""

NO_KEY = "none"
"""Placeholder key: local endpoints such as Ollama and vLLM need none, but the SDKs require one."""

_MAX_CHARACTERS = 500
_REFUSED = (400, 422)
_TOO_LONG = re.compile(
    r"context.{0,20}(length|window|size)|too long|too many tokens|maximum.{0,40}tokens|exceed.{0,40}(token|context)", re.I
)
_FILTERED = re.compile(r"content[ _-]?(filter|management policy)|ResponsibleAIPolicyViolation", re.I)
_KEY = re.compile(r"\b(sk|pk|rk|key)-[\w*.…-]{6,}", re.I)


class EndpointError(TandemError):
    """The model's endpoint gives no reply."""


class TooLong(EndpointError):
    """The conversation is longer than the model can read."""


class Filtered(EndpointError):
    """A filter of the endpoint refused the conversation."""


class MissingPackage(TandemError):
    """An SDK is not installed."""


class Model(Protocol):
    """A model that calls tools."""

    def ask(self, instructions: str, tools: Sequence[Tool], turns: Sequence[Turn]) -> Reply:
        """Sends the conversation to the model and returns its reply. Raises EndpointError."""
        ...


def import_sdk(name: str) -> Any:
    """Imports the SDK of this name."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingPackage(f"the package {name} is missing ({error}); {INSTALL}") from error


def open_client(sdk: Any, make: Callable[..., Any], settings: AgentSettings, key_variables: Sequence[str]) -> Any:
    """Creates a client of an SDK, with the key from its environment variable."""
    options: dict[str, Any] = {"max_retries": RETRIES}
    if settings.base_url is not None:
        options["base_url"] = settings.base_url
    if not any(os.environ.get(variable) for variable in key_variables):
        if settings.base_url is None and not os.environ.get(key_variables[0].replace("API_KEY", "BASE_URL")):
            raise EndpointError(
                f"no key for {settings.model}; set {key_variables[0]}, or give --base-url for an endpoint of your own"
            )
        options["api_key"] = NO_KEY
    try:
        return make(**options)
    except sdk.APIError as error:
        raise EndpointError(without_keys(str(error))) from None


class OptionalFields:
    """Optional fields of a request, which not every endpoint supports. A field that an endpoint refuses by name is
    left out from then on.

    Args:
        returned: Fields of the model's replies that are sent back, as some models require.
    """

    def __init__(self, returned: Sequence[str] = (), **fields: Any) -> None:
        self.fields = {name: value for name, value in fields.items() if value is not None}
        self.returned = set(returned)

    def drop_named(self, text: str) -> bool:
        """Drops the fields that a refusal names. Returns true if it named any."""
        named = [name for name in self.fields if name in text]
        for name in named:
            del self.fields[name]
        sent_back = {name for name in self.returned if name in text}
        self.returned -= sent_back
        return bool(named or sent_back)


def request(sdk: Any, settings: AgentSettings, optional: OptionalFields, send: Callable[..., Any]) -> tuple[Any, int]:
    """Sends a request, and repeats it without the fields that the endpoint does not support. Returns the answer and
    the number of requests that failed before it.

    send: Sends the request with these optional fields, and returns the SDK's raw response.
    """
    repeats = 0
    while True:
        try:
            response = send(**optional.fields)
            reply = response.parse()
            if isinstance(reply, str):
                raise EndpointError(
                    f"{_where(settings)} answers no JSON of the API {settings.api}; is --base-url right? Most end in /v1"
                )
            return reply, repeats + response.retries_taken
        except sdk.APIStatusError as error:
            told = f"{error.message} {error.body}"
            if error.status_code in _REFUSED and optional.drop_named(told):
                repeats += 1
                continue
            raise _status_error(settings, error.status_code, error.message, told) from None
        except sdk.APIError as error:
            cause = f": {error.__cause__}" if error.__cause__ is not None else ""
            raise EndpointError(without_keys(f"{_where(settings)}: {error}{cause}")) from None
        except EndpointError:
            raise
        except Exception as error:
            # Some versions of the SDKs pass invalid or truncated JSON on without an error of their own.
            text = f"{_where(settings)} answers nothing that the API {settings.api} knows: {type(error).__name__}: {error}"
            raise EndpointError(without_keys(text[:_MAX_CHARACTERS])) from None


def understood(settings: AgentSettings, retries: int, read: Callable[[], Reply]) -> Reply:
    """Reads a reply from an answer, in which fields promised by the API may be missing.

    retries: Number of requests that failed before it.
    """
    try:
        return replace(read(), retries=retries)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        text = f"{_where(settings)} answers what is no reply of the API {settings.api}: {type(error).__name__}: {error}"
        raise EndpointError(without_keys(text[:_MAX_CHARACTERS])) from None


def _status_error(settings: AgentSettings, status: int, message: str, told: str) -> EndpointError:
    short = " ".join(message.removeprefix(f"Error code: {status} - ").split())[:_MAX_CHARACTERS]
    text = without_keys(f"{_where(settings)} answers {status}: {short}")
    if status in (*_REFUSED, 413) and _TOO_LONG.search(told):
        return TooLong(text)
    if status in _REFUSED and _FILTERED.search(told):
        return Filtered(text)
    return EndpointError(text)


def _where(settings: AgentSettings) -> str:
    return f"{settings.model} at {settings.base_url or 'its endpoint'}"


def without_keys(text: str) -> str:
    """Removes all keys from a text, because refusals of a wrong key quote it."""
    for variable in ("OPENAI_API_KEY", "OPENAI_ADMIN_KEY", "ANTHROPIC_API_KEY", "ANTHROPIC_AUTH_TOKEN", "TANDEM_TOKEN"):
        key = os.environ.get(variable)
        if key and key != NO_KEY:
            text = text.replace(key, f"({variable})")
    return _KEY.sub("(key)", text)
