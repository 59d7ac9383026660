"""Which model plays, and what it may use up."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias, get_args
from urllib.parse import urlsplit

from ..errors import TandemError
from .conversation import Usage

Api: TypeAlias = Literal["openai", "openai-chat", "anthropic"]
"""OpenAI's Responses, its Chat Completions, or Anthropic's Messages: the names that `GET /v1/tools?format=` has."""

APIS: tuple[Api, ...] = get_args(Api)

CACHE_WRITE_FACTOR = 1.25
"""What a token costs that is written to a cache, in tokens that are only read. Anthropic and OpenAI ask so much."""


@dataclass(frozen=True)
class Prices:
    """US dollars for a million tokens."""

    input: float
    output: float
    cached: float | None = None
    """Of input that comes from a cache. None: as other input."""

    def usd(self, usage: Usage) -> float:
        """What a request cost."""
        cached = self.input if self.cached is None else self.cached
        fresh = usage.input - usage.cached - usage.cache_written
        reading = fresh * self.input + usage.cached * cached + usage.cache_written * self.input * CACHE_WRITE_FACTOR
        return (reading + usage.output * self.output) / 1e6


@dataclass(frozen=True)
class Limits:
    """What a model may use up in one episode; None: any amount."""

    tokens: int | None = None
    """Read and written, cached ones included."""

    usd: float | None = None
    calls: int | None = None
    """Calls of tools."""

    seconds: float | None = None
    """Since the agent began."""


KEPT_FIELDS = ("model", "messages", "input", "instructions", "system", "tools", "stream")
SECRET_FIELDS = ("api_key", "authorization")
"""Fields of a request that --extra-body may not have: they are the agent's, or would be written down."""


@dataclass(frozen=True)
class Sampling:
    """How replies are sampled; None: as the endpoint does by itself."""

    temperature: float | None = None
    top_p: float | None = None
    seed: int | None = None
    extra_body: dict[str, Any] | None = None
    """Further fields of each request, as the endpoint wants them."""

    def __post_init__(self) -> None:
        for name in self.extra_body or {}:
            if name in KEPT_FIELDS or name.lower() in SECRET_FIELDS:
                raise TandemError(f"--extra-body has {name!r}, which is the agent's own; leave it out")

    @property
    def told(self) -> dict[str, Any]:
        """What is set, as recordings have it."""
        fields = {"temperature": self.temperature, "top_p": self.top_p, "seed": self.seed, "extra_body": self.extra_body}
        return {name: value for name, value in fields.items() if value is not None}

    def fields(self, api: Api) -> dict[str, Any]:
        """What requests have of it, as the SDKs take it. A field that the endpoint does not know is refused, not left out."""
        if self.seed is not None and api != "openai-chat":
            raise TandemError(f"the API {api} takes no --sampling-seed; leave it out, or use --api openai-chat")
        return self.told


@dataclass(frozen=True)
class AgentSettings:
    """An agent: a model behind an endpoint."""

    model: str
    api: Api = "openai"
    base_url: str | None = None
    """Where the endpoint is. None: where the SDK has it, by its environment variable or by default."""

    effort: str | None = None
    """How much the model thinks, in its API's own words. None: as it does by itself."""

    context_tokens: int = 100_000
    """The longest conversation; of a longer one the oldest half becomes a list of its calls."""

    limits: Limits = field(default_factory=Limits)
    prices: Prices | None = None
    sampling: Sampling = field(default_factory=Sampling)

    def __post_init__(self) -> None:
        if self.limits.usd is not None and self.prices is None:
            raise TandemError("--max-usd needs prices: give --usd-per-million-input and --usd-per-million-output")
        if self.base_url is not None:
            check_base_url(self.base_url)
        self.sampling.fields(self.api)


def check_base_url(url: str) -> None:
    """Refuses what is no address, and one with a key in it, which would be written down."""
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise TandemError(f"{url!r} is no address of an endpoint; give one as http://127.0.0.1:11434/v1")
    if parts.username is not None or parts.password is not None or parts.query:
        raise TandemError("--base-url takes no key; give it by the SDK's environment variable, as OPENAI_API_KEY")
