"""One adapter per wire format, built on the official SDKs, which retry, wait and keep the formats current."""

from __future__ import annotations

from .endpoint import EndpointError, Filtered, MissingPackage, Model, TooLong, without_keys
from .models import open_model

__all__ = ["EndpointError", "Filtered", "MissingPackage", "Model", "TooLong", "open_model", "without_keys"]
