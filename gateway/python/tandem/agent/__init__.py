"""Language models as players: a tool loop for any endpoint with OpenAI's or Anthropic's formats.

python -m tandem.agent --model NAME --api openai --task handover --seed 0
"""

from __future__ import annotations

from .apis import EndpointError, MissingPackage
from .command_line import main
from .settings import AgentSettings, Api, Limits, Prices, Team

__all__ = ["AgentSettings", "Api", "EndpointError", "Limits", "MissingPackage", "Prices", "Team", "main"]
