"""Choice of the model, and its limits."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias, get_args
from urllib.parse import urlsplit

from ..errors import TandemError
from .conversation import Usage

Api: TypeAlias = Literal["openai", "openai-chat", "anthropic"]
"""OpenAI's Responses, its Chat Completions, or Anthropic's Messages, by their names in `GET /v1/tools?format=`."""

APIS: tuple[Api, ...] = get_args(Api)

CACHE_WRITE_FACTOR = 1.25
"""Price of a token written to a cache, relative to an input token. Anthropic and OpenAI charge this much."""


@dataclass(frozen=True)
class Prices:
    """Prices in US dollars per million tokens."""

    input: float
    output: float
    cached: float | None = None
    """Price of cached input. None: the same as other input."""

    def usd(self, usage: Usage) -> float:
        """Returns the price of a request."""
        cached = self.input if self.cached is None else self.cached
        fresh = usage.input - usage.cached - usage.cache_written
        reading = fresh * self.input + usage.cached * cached + usage.cache_written * self.input * CACHE_WRITE_FACTOR
        return (reading + usage.output * self.output) / 1e6


@dataclass(frozen=True)
class Limits:
    """Limits of a model in one episode; None means unlimited."""

    tokens: int | None = None
    """Input and output tokens, cached ones included."""

    usd: float | None = None
    calls: int | None = None
    """Number of tool calls."""

    seconds: float | None = None
    """Seconds since the agent began."""


KEPT_FIELDS = ("model", "messages", "input", "instructions", "system", "tools", "stream")
SECRET_FIELDS = ("api_key", "authorization")
"""Fields of a request that --extra-body may not have, because they are the agent's or would be written to a file."""


@dataclass(frozen=True)
class Sampling:
    """Sampling parameters; None means the endpoint's default."""

    temperature: float | None = None
    top_p: float | None = None
    seed: int | None = None
    extra_body: dict[str, Any] | None = None
    """Additional fields of each request to the endpoint."""

    def __post_init__(self) -> None:
        for name in self.extra_body or {}:
            if name in KEPT_FIELDS or name.lower() in SECRET_FIELDS:
                raise TandemError(f"--extra-body has {name!r}, which is the agent's own; leave it out")

    @property
    def told(self) -> dict[str, Any]:
        """Parameters that are set, in the form for recordings."""
        fields = {"temperature": self.temperature, "top_p": self.top_p, "seed": self.seed, "extra_body": self.extra_body}
        return {name: value for name, value in fields.items() if value is not None}

    def fields(self, api: Api) -> dict[str, Any]:
        """Returns the parameters for requests, in the SDKs' form. A field that the API does not support is refused,
        not dropped.
        """
        if self.seed is not None and api != "openai-chat":
            raise TandemError(f"the API {api} takes no --sampling-seed; leave it out, or use --api openai-chat")
        return self.told


@dataclass(frozen=True)
class AgentSettings:
    """An agent: a model behind an endpoint."""

    model: str
    api: Api = "openai"
    base_url: str | None = None
    """URL of the endpoint. None: the SDK's, from its environment variable or its default."""

    effort: str | None = None
    """Reasoning effort in the API's terms. None: the model's default."""

    context_tokens: int = 100_000
    """Maximum length of the conversation in tokens; the oldest half of a longer one becomes a list of its calls."""

    limits: Limits = field(default_factory=Limits)
    prices: Prices | None = None
    sampling: Sampling = field(default_factory=Sampling)

    def __post_init__(self) -> None:
        if self.limits.usd is not None and self.prices is None:
            raise TandemError("--max-usd needs prices: give --usd-per-million-input and --usd-per-million-output")
        if self.base_url is not None:
            check_base_url(self.base_url)
        self.sampling.fields(self.api)

    @property
    def told(self) -> dict[str, Any]:
        """The settings in the form for files."""
        return {**asdict(self), "sampling": self.sampling.told}


@dataclass(frozen=True)
class Team:
    """Settings of the models of an episode."""

    common: AgentSettings
    """Model of all robots, or of each robot without a model of its own."""

    robots: dict[str, AgentSettings] = field(default_factory=dict[str, AgentSettings])
    """Models of single robots."""

    def of(self, robot: str | None) -> AgentSettings:
        """Returns the model of a robot; None: of all robots."""
        return self.common if robot is None else self.robots.get(robot, self.common)


def check_base_url(url: str) -> None:
    """Refuses an invalid URL, and one with a key in it, because the URL would be written to a file."""
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise TandemError(f"{url!r} is no address of an endpoint; give one as http://127.0.0.1:11434/v1")
    if parts.username is not None or parts.password is not None or parts.query:
        raise TandemError("--base-url takes no key; give it by the SDK's environment variable, as OPENAI_API_KEY")
