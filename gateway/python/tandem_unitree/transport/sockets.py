"""ZMQ sockets."""

from __future__ import annotations

import zmq

from tandem import TandemError

_CONTEXT = zmq.Context()


def bound(kind: int, address: str, port: int, **options: int) -> zmq.Socket[bytes]:
    """Returns a socket that clients connect to; options are set by their names, for example `SNDHWM`."""
    socket = _CONTEXT.socket(kind)
    for name, value in options.items():
        socket.setsockopt(zmq.SocketOption[name], value)
    try:
        socket.bind(f"tcp://{address}:{port}")
    except zmq.ZMQError as error:
        raise TandemError(f"{address}:{port} cannot be served ({error}); give another address with --addresses") from error
    return socket


def received(socket: zmq.Socket[bytes]) -> bytes | None:
    """Returns the next message, or `None` if none has come."""
    try:
        return socket.recv(zmq.NOBLOCK)
    except zmq.Again:
        return None


class Publisher:
    """A PUB socket that knows whether anybody listens. All calls come from one thread."""

    def __init__(self, address: str, port: int) -> None:
        self._socket = bound(zmq.XPUB, address, port, SNDHWM=2, XPUB_VERBOSER=1)
        self._subscriptions = 0

    def has_subscribers(self) -> bool:
        """Returns whether a client has subscribed."""
        while (notice := received(self._socket)) is not None:
            self._subscriptions += 1 if notice[:1] == b"\x01" else -1
        return self._subscriptions > 0

    def send(self, payload: bytes) -> None:
        """Sends to all clients; one that does not keep up misses messages."""
        try:
            self._socket.send(payload, zmq.NOBLOCK)
        except zmq.Again:
            return
