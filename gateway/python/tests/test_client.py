"""Connections that a server closes while a model thinks, and connections that stay open."""

from __future__ import annotations

import base64
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from scripted_endpoint import Says, Script, ScriptedEndpoint

import tandem
from tandem.agent import main

THOUGHT_S = 45.0
"""Longer than a server waits for the header of a request."""

OK = b"HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: 2\r\n\r\n{}"


class Flaky:
    """A server that closes connections at chosen moments.

    answers: For each request of a connection, in turn, what it is answered with, or whether; behind the last one the
        connection is closed.
    """

    def __init__(self, *connections: Sequence[bool | bytes]) -> None:
        self.requests: list[tuple[str, str | None]] = []
        self._connections = connections
        self._port = 0
        self.open()
        self.url = f"http://127.0.0.1:{self._port}"

    def open(self) -> None:
        """Listens again at the same address."""
        self._listener = socket.create_server(("127.0.0.1", self._port))
        self._port = self._listener.getsockname()[1]
        threading.Thread(target=self._serve, args=(self._listener,), daemon=True).start()

    def close(self) -> None:
        """Stops listening."""
        self._listener.close()

    def _serve(self, listener: socket.socket) -> None:
        for answers in self._connections:
            connection, _ = listener.accept()
            with connection, connection.makefile("rb") as lines:
                for answer in answers:
                    self.requests.append(_read(lines))
                    if answer is not False:
                        connection.sendall(OK if answer is True else answer)


def _read(lines: Any) -> tuple[str, str | None]:
    """Returns the first line of a request, and its key."""
    first, key, length = lines.readline().decode().rsplit(" ", 1)[0], None, 0
    while line := lines.readline().decode().strip():
        name, _, value = line.partition(": ")
        key = value if name.lower() == "idempotency-key" else key
        length = int(value) if name.lower() == "content-length" else length
    lines.read(length)
    return first, key


def test_a_connection_that_is_gone_is_opened_anew() -> None:
    """Tests any request on a connection that the server has closed."""
    server = Flaky([True], [True], [True])
    client = tandem.Client(server.url)
    for method, path in (("GET", "/v1/tasks"), ("DELETE", "/v1/episodes/x"), ("POST", "/v1/episodes/x/notes")):
        client.request(method, path)
        # The client notices a closed connection a moment later.
        time.sleep(0.2)
    assert [line for line, _ in server.requests] == ["GET /v1/tasks", "DELETE /v1/episodes/x", "POST /v1/episodes/x/notes"]


def test_only_what_is_carried_out_once_is_sent_again() -> None:
    call = "/v1/episodes/x/tools/wait"
    server = Flaky([True, False], [True])
    client = tandem.Client(server.url)
    client.request("GET", "/v1/tasks")
    client.request("POST", call, {"steps": 1})
    (_, _), (first, key), (again, same) = server.requests
    assert first == again == f"POST {call}" and key == same and key is not None
    server = Flaky([True, False], [True])
    client = tandem.Client(server.url)
    client.request("GET", "/v1/tasks")
    with pytest.raises(tandem.Unreachable):
        client.request("DELETE", "/v1/episodes/x")
    assert [line for line, _ in server.requests] == ["GET /v1/tasks", "DELETE /v1/episodes/x"]


def test_every_call_has_a_key_of_its_own() -> None:
    server = Flaky([True, True, True])
    client = tandem.Client(server.url)
    for path in ("/v1/episodes", "/v1/episodes/x/tools/wait", "/v1/episodes/x/notes"):
        client.request("POST", path)
    keys = [key for _, key in server.requests]
    assert all(keys) and len(set(keys)) == 3


def test_a_server_that_is_started_again_is_waited_for() -> None:
    """Tests also a server that has never answered, for which the client does not wait."""
    server = Flaky([True])
    client = tandem.Client(server.url)
    client.request("GET", "/v1/tasks")
    server.close()

    def start_again() -> None:
        time.sleep(1.0)
        server.open()

    threading.Thread(target=start_again, daemon=True).start()
    client.request("POST", "/v1/episodes/x/tools/wait", {"steps": 1})
    assert [line for line, _ in server.requests] == ["GET /v1/tasks", "POST /v1/episodes/x/tools/wait"]
    server.close()
    began_s = time.monotonic()
    with pytest.raises(tandem.Unreachable):
        tandem.Client(server.url).request("GET", "/v1/tasks")
    assert time.monotonic() - began_s < 1.0


def test_an_episode_is_followed_to_the_server_that_plays_it() -> None:
    player = Flaky([True, True])
    sends = f"HTTP/1.1 307 Elsewhere\r\nlocation: {player.url}/v1/episodes/x/tools/wait\r\ncontent-length: 0\r\n\r\n".encode()
    asked = Flaky([sends, sends])
    client = tandem.Client(asked.url)
    for _ in range(2):
        client.request("POST", "/v1/episodes/x/tools/wait", {"steps": 1})
    assert player.requests == asked.requests


def test_an_address_that_is_none_is_refused_at_once() -> None:
    for url in ("127.0.0.1:8700", "http://127.0.0.1:port", "ftp://127.0.0.1"):
        with pytest.raises(tandem.TandemError, match=r"give one as http://127\.0\.0\.1:8700"):
            tandem.Client(url)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[tandem.Server]:
    with tandem.serve(runs=tmp_path / "runs", max_episodes=8) as server:
        yield server


def test_connections_outlive_a_long_thought(
    server: tandem.Server, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Tests a client, an agent and a WebSocket at the same time, so that the test waits only once."""
    monkeypatch.setenv("OPENAI_API_KEY", "sk-test-0123456789abcdef")
    failures: list[BaseException] = []

    def beside(work: Callable[[], None]) -> threading.Thread:
        def guarded() -> None:
            try:
                work()
            except BaseException as failure:
                failures.append(failure)

        thread = threading.Thread(target=guarded)
        thread.start()
        return thread

    threads = [beside(work) for work in (lambda: _client(server), lambda: _agent(server), lambda: _web_socket(server))]
    for thread in threads:
        thread.join()
    assert not failures, failures


def _client(server: tandem.Server) -> None:
    client = tandem.Client(server.url)
    with client.episode("handover", 2000) as episode:
        before: Any = client._connection.sock
        time.sleep(THOUGHT_S)
        episode.wait(1)
        assert client._connection.sock is before, "the server has closed it"


def _agent(server: tandem.Server) -> None:
    def script(_: str) -> Script:
        yield Says(calls=(("wait", {"steps": 1}),))
        time.sleep(THOUGHT_S)
        yield Says(calls=(("finish", {}),))

    with ScriptedEndpoint(script) as endpoint:
        where = ["--api", "openai-chat", "--base-url", endpoint.base_url("openai-chat"), "--url", server.url]
        assert main(["--model", "scripted", *where, "--task", "handover", "--seed", "2001"]) == 0


def _web_socket(server: tandem.Server) -> None:
    """Tests that a person's socket answers a ping after the same silence."""
    host = tandem.Client(server.url)
    start = host.request("POST", "/v1/episodes", {"task": "handover", "seed": 2002, "operators": "per_robot"})
    token = start["operators"][0]["token"]
    key = base64.b64encode(os.urandom(16)).decode()
    address = server.url.removeprefix("http://")
    name, port = address.split(":")
    with socket.create_connection((name, int(port)), timeout=30) as connection:
        head = [
            "GET /operate/drive?robots=A HTTP/1.1",
            f"host: {address}",
            "upgrade: websocket",
            "connection: upgrade",
            "sec-websocket-version: 13",
            f"sec-websocket-key: {key}",
            f"cookie: tandem_operator_A={token}",
        ]
        connection.sendall("\r\n".join([*head, "", ""]).encode())
        heard = connection.makefile("rb")
        assert heard.readline().startswith(b"HTTP/1.1 101")
        while heard.readline().strip():
            pass
        time.sleep(THOUGHT_S)
        mask, payload = os.urandom(4), b"there?"
        masked = bytes(byte ^ mask[index % 4] for index, byte in enumerate(payload))
        connection.sendall(bytes([0x89, 0x80 | len(payload)]) + mask + masked)
        while True:
            opcode, length = heard.read(1)[0] & 0x0F, heard.read(1)[0]
            if length == 126:
                length = int.from_bytes(heard.read(2), "big")
            elif length == 127:
                length = int.from_bytes(heard.read(8), "big")
            told = heard.read(length)
            if opcode == 0x0A:
                assert told == payload
                break
    assert json.dumps(host.request("DELETE", f"/v1/episodes/{start['episode_id']}"))
