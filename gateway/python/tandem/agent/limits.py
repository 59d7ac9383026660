"""A model's usage and its limits."""

from __future__ import annotations

import time
from collections.abc import Callable

from .conversation import Stopped, Usage
from .settings import Limits, Prices


class Ledger:
    """Counts a model's usage in one episode."""

    def __init__(self, limits: Limits, prices: Prices | None, clock: Callable[[], float] = time.monotonic) -> None:
        self.limits = limits
        self.prices = prices
        self.input = self.output = self.cached = self.calls = self.requests = 0
        self.usd = 0.0
        self._last_tokens = 0
        self._last_usd = 0.0
        self._clock = clock
        self._began_s = clock()

    def price(self, usage: Usage) -> float | None:
        """Returns the price of a request in US dollars, if prices are given."""
        return None if self.prices is None else self.prices.usd(usage)

    def add(self, usage: Usage, usd: float | None) -> None:
        """Counts a request and its price."""
        self.requests += 1
        self.input += usage.input
        self.output += usage.output
        self.cached += usage.cached
        self.usd += usd or 0.0
        self._last_tokens = usage.input + usage.output
        self._last_usd = usd or 0.0

    @property
    def seconds(self) -> float:
        """Playing time of the agent in seconds."""
        return self._clock() - self._began_s

    def take_up(self, seconds: float) -> None:
        """Continues after `seconds` of earlier play; the time since then is not counted."""
        self._began_s = self._clock() - seconds

    def reason_to_stop(self) -> Stopped | None:
        """Returns the reason why no further request may be made. A request is assumed to cost as much as the last
        one, because conversations grow.
        """
        limits, tokens = self.limits, self.input + self.output
        if limits.tokens is not None and tokens + self._last_tokens > limits.tokens:
            text = f"{tokens} tokens were used, and the next reply would pass --max-tokens-total {limits.tokens}"
            return Stopped("token_limit", text)
        if limits.usd is not None and self.usd + self._last_usd > limits.usd:
            text = f"{self.usd:.4f} US dollars were spent, and the next reply would pass --max-usd {limits.usd:g}"
            return Stopped("price_limit", text)
        if limits.calls is not None and self.calls >= limits.calls:
            return Stopped("call_limit", f"all of --max-calls {limits.calls} were made")
        if limits.seconds is not None and self.seconds >= limits.seconds:
            return Stopped("time_limit", f"--max-seconds {limits.seconds:g} are over")
        return None

    def summary(self) -> str:
        """Returns the usage in a line."""
        told = f"{self.calls} calls, {self.requests} replies"
        told = f"{told}, {self.input} tokens read ({self.cached} cached), {self.output} written"
        price = "" if self.prices is None else f", {self.usd:.4f} US dollars"
        return f"{told}{price}, {self.seconds:.0f} s"
