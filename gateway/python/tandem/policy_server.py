"""Server for a learned policy of this process, for `tandem evaluate --policy act:...`."""

from __future__ import annotations

import base64
import binascii
import json
import sys
import threading
import traceback
from collections import OrderedDict
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from .errors import TandemError

Infer: TypeAlias = Callable[[dict[str, Any], dict[str, Any]], Mapping[str, Any]]
"""Policy function: takes the inputs of a policy map, with NumPy arrays, and the episode's memory. Returns arrays by
the map's action keys.
"""

MOMENT = "moment"
"""Key, or prefix of it, under which a map sends `["episode", "step", "reset"]`."""

MAX_PRINTED = 20
"""Maximum number of different tracebacks to print."""

REMEMBERED = 256
"""Maximum number of episodes with a memory; the ones used longest ago are dropped."""


class PolicyServer:
    """A running policy server. It ends with a `with` block, or by `stop`."""

    def __init__(self, server: ThreadingHTTPServer, paths: list[str]) -> None:
        self._server = server
        self._paths = paths
        self._thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Value for `--policy` of `tandem evaluate`: "act:http://127.0.0.1:8001/act", or a URL for each robot."""
        host, port = str(self._server.server_address[0]), self._server.server_address[1]
        return "act:" + ",".join(f"http://{host}:{port}/{path}" for path in self._paths)

    def wait(self) -> None:
        """Waits until the server has ended."""
        while self._thread.is_alive():
            # On some platforms, a wait without a timeout would ignore Ctrl-C.
            self._thread.join(0.5)

    def stop(self) -> None:
        """Stops the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> PolicyServer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.stop()


def serve_policy(infer: Infer | Mapping[str, Infer], *, host: str = "127.0.0.1", port: int = 0) -> PolicyServer:
    """Starts a server for `tandem evaluate --policy act:...`, and returns at once. Requests are answered one after
    another.

    Args:
        infer: Called with the inputs of the policy map, by key, and with the policy's memory; returns arrays by the
            map's action keys. The memory is a dictionary that is empty at an episode's first request and kept until the
            episode ends. Each episode has its own dictionary if the map has `"moment" = ["episode", "step", "reset"]`
            among its states; otherwise every request has an empty one. With a mapping, each robot's policy is served at
            its own address, for maps with local scope.
        host: Address to listen on.
        port: Port; 0 picks a free one.
    """
    policies = {"act": infer} if callable(infer) else dict(infer)
    if not policies:
        raise TandemError("no policy to serve; give a function, or one for each robot by its name")
    answering = _Answering(policies)
    return PolicyServer(ThreadingHTTPServer((host, port), _handler(answering)), list(policies))


class _Answering:
    """Policies by path, and their memories of episodes."""

    def __init__(self, policies: dict[str, Infer]) -> None:
        self._policies = policies
        self._memories: OrderedDict[tuple[str, int], dict[str, Any]] = OrderedDict()
        # A policy is one model, which answers one request at a time.
        self._one_by_one = threading.Lock()
        self._printed: set[str] = set()

    def answer(self, path: str, body: bytes) -> bytes:
        infer = self._policies.get(path)
        if infer is None:
            raise TandemError(f"no policy at /{path}; have: {', '.join('/' + path for path in self._policies)}")
        observation = cast(dict[str, Any], json.loads(body, object_hook=_from_json))
        with self._one_by_one:
            reply = infer(observation, self._memory(path, observation))
        return json.dumps({key: np.asarray(value, np.float64).tolist() for key, value in reply.items()}).encode()

    def print_once(self, error: Exception) -> None:
        """Prints an exception of a policy, each different one once."""
        told = f"{type(error).__name__}: {error}"
        if told not in self._printed and len(self._printed) < MAX_PRINTED:
            self._printed.add(told)
            traceback.print_exception(error, file=sys.stderr)

    def _memory(self, path: str, observation: dict[str, Any]) -> dict[str, Any]:
        moment = next((value for key, value in observation.items() if key.startswith(MOMENT)), None)
        if moment is None:
            return {}
        episode, _, reset = np.ravel(moment)[-3:]
        key = (path, int(episode))
        if reset or key not in self._memories:
            self._memories[key] = {}
        self._memories.move_to_end(key)
        while len(self._memories) > REMEMBERED:
            self._memories.popitem(last=False)
        return self._memories[key]


def _from_json(entry: dict[str, Any]) -> Any:
    """Converts arrays in the format of the package json_numpy; they are writable."""
    if "__numpy__" not in entry:
        return entry
    flat: NDArray[Any] = np.frombuffer(base64.b64decode(entry["__numpy__"]), entry["dtype"])
    return np.array(np.reshape(flat, entry["shape"]))


def _handler(answering: _Answering) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        # Otherwise the body of an answer would wait 40 ms for the acknowledgement of its header.
        disable_nagle_algorithm = True

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers.get("content-length", 0)))
            try:
                status, answer = 200, answering.answer(self.path.strip("/"), body)
            except TandemError as error:
                status, answer = 404, str(error).encode()
            except (json.JSONDecodeError, binascii.Error) as error:
                status, answer = 400, f"no observation as json_numpy writes it: {error}".encode()
            except Exception as error:
                # A policy's exception is sent to the evaluation, which reports it in the result, and printed here
                # for the policy's author.
                answering.print_once(error)
                status, answer = 500, f"{type(error).__name__}: {error}".encode()
            self.send_response(status)
            self.send_header("content-type", "application/json" if status == 200 else "text/plain")
            self.send_header("content-length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, format: str, *args: object) -> None:
            """Suppresses the log of requests."""

    return Handler
