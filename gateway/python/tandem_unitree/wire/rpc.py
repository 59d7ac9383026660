"""`Request_` and `Response_` of unitree_api in CDR, little-endian."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from .layout import HEADER

_REQUEST = struct.Struct("<qqqi?3xI")
"""Identity (id, api_id), lease, priority, noreply, and the length of the parameter."""

_RESPONSE = struct.Struct("<qqiI")
"""Identity (id, api_id), status code, and the length of the data."""

OK = 0
"""Status code of a request that was carried out."""

NOT_IMPLEMENTED = 3203
"""Status code of a request that the robot cannot carry out."""

BAD_PARAMETER = 3204
"""Status code of a request whose parameter cannot be read."""


@dataclass(frozen=True)
class Request:
    """A call of a service."""

    id: int
    api_id: int
    parameter: str
    noreply: bool = False

    @staticmethod
    def of(message: bytes) -> Request | None:
        """Reads a serialized `Request_`; returns `None` if it is cut off or big-endian."""
        body = message[len(HEADER) :]
        if message[1:2] not in (b"\x01", b"\x07") or len(body) < _REQUEST.size:
            return None
        identity, api_id, _lease, _priority, noreply, length = _REQUEST.unpack_from(body)
        text = body[_REQUEST.size : _REQUEST.size + length]
        if len(text) < length:
            return None
        return Request(identity, api_id, text.rstrip(b"\0").decode(errors="replace"), noreply)


def response(request: Request, code: int, data: str) -> bytes:
    """Returns a serialized `Response_` to `request`, without binary data."""
    text = data.encode() + b"\0"
    padding = b"\0" * (-len(text) % 4)
    body = _RESPONSE.pack(request.id, request.api_id, code, len(text)) + text + padding
    return HEADER + body + struct.pack("<I", 0)
