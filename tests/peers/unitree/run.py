"""Other projects' programs for a Unitree G1 drive Tandem's robots, each in a network namespace with `lo` alone.

    python tests/peers/unitree/run.py --wheel target/wheels/tandem_sim-*.whl
    python tests/peers/unitree/run.py --wheel target/wheels/tandem_sim-*.whl sdk latency

Environments are made in `target/unitree` by Python 3.10 (`cyclonedds` 0.10 has no wheel for a later one) and 3.12
(LeRobot). What cannot be had here is skipped, and said: an interpreter, a package, namespaces, or libturbojpeg for
teleimager's client.
"""

import argparse
import ctypes.util
import fcntl
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = ("bridge", "clients", "lerobot", "recorder")
MAX_CLIENT_S = 180
STARTING_S = 30
SIOCSIFFLAGS, IFF_UP = 0x8914, 1


@dataclass
class Case:
    """Arguments of the bridge, and clients that run at once: the environment, the script and its arguments."""

    bridge: list[str]
    clients: list[tuple[str, ...]]
    needs_library: str | None = None
    needs_variable: str | None = None
    environments: set[str] = field(init=False)

    def __post_init__(self):
        self.environments = {client[0] for client in self.clients} | {"bridge"}


ONE = ["--task", "handover", "--robots", "A"]
CASES = {
    "book": Case(ONE, [("clients", "book.py", "1")]),
    "sdk": Case(ONE, [("clients", "sdk.py", "1")]),
    "far": Case([*ONE, "--domains", "A=0"], [("clients", "far.py")]),
    "joint": Case([*ONE, "--joint-control"], [("clients", "joint.py", "1")]),
    "whole_body": Case([*ONE, "--joint-control"], [("clients", "whole_body.py", "1")], needs_variable="TANDEM_POLICY"),
    "lerobot": Case(
        ["--task", "handover"],
        [("lerobot", "lerobot_g1.py", "127.0.0.2", "0.25"), ("lerobot", "lerobot_g1.py", "127.0.0.3", "-0.25")],
    ),
    "lerobot_record": Case(
        ["--task", "handover", "--episodes", "3", "--camera-fps", "10"],
        [("recorder", "lerobot_record.py", f"127.0.0.{2 + index}", robot) for index, robot in enumerate("AB")],
    ),
    "inspect": Case([*ONE, "--domains", "A=0"], [("clients", "inspect_g1.py")]),
    "teleimager": Case(ONE, [("clients", "teleimager_client.py")], needs_library="turbojpeg"),
    "hold": Case(["--task", "handover", "--clock", "hold"], [("clients", "thinking.py", "1", "hold")]),
    "real": Case(ONE, [("clients", "thinking.py", "1", "real")]),
    "latency": Case(ONE, [("clients", "latency.py", "1")]),
    "latency_two": Case(["--task", "handover"], [("clients", "latency.py", domain) for domain in "12"]),
    "three": Case(["--task", "big_table"], [("clients", "latency.py", "1")]),
}


class Skipped(Exception):
    """A requirement is missing on this machine."""


def command(*words, **options):
    """Runs a command to its end, or raises the exception for a skipped case."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False, **options)
    except OSError as error:
        raise Skipped(f"{words[0]} cannot be run: {error}") from error
    if done.returncode != 0:
        raise Skipped(f"{' '.join(map(str, words))} failed: {(done.stderr or done.stdout).strip()[-300:]}")


def fingerprint(word):
    """Returns a word of a command line, with the contents or the age of the file that it names."""
    path = Path(word.partition("[")[0])
    if path.suffix == ".txt":
        return path.read_text()
    return f"{word} {path.stat().st_mtime_ns}" if path.suffix == ".whl" and path.exists() else word


def interpreter_of(version):
    """Returns an interpreter of a version of Python that runs, from the path or from pyenv."""
    name = f"python{version}"
    found = [shutil.which(name), *sorted(Path.home().glob(f".pyenv/versions/{version}*/bin/{name}"))]
    for path in filter(None, found):
        if subprocess.run([path, "--version"], capture_output=True, check=False).returncode == 0:
            return str(path)
    raise Skipped(f"no {name}")


def environment(folder, version, *installs):
    """Returns the interpreter of an environment, and creates the environment if necessary."""
    python = folder / "bin" / "python"
    done, wanted = folder / "complete.txt", "\n".join(fingerprint(word) for install in installs for word in install)
    if done.exists() and done.read_text() == wanted:
        return python
    found = interpreter_of(version)
    command(found, "-m", "venv", "--clear", str(folder))
    for install in installs:
        command(str(python), "-m", "pip", "install", "--quiet", *install)
    done.write_text(wanted)
    return python


def environments(given):
    """Returns what makes each environment; those that were given are taken as they are."""
    folder = Path(given.environments).absolute()
    own = {
        "bridge": lambda: environment(folder / "bridge", "3.10", [f"{given.wheel}[unitree]"]),
        "clients": lambda: environment(
            folder / "clients",
            "3.10",
            ["-r", str(HERE / "clients.txt")],
            ["--no-deps", "-r", str(HERE / "clients_alone.txt")],
        ),
        "lerobot": lambda: environment(
            folder / "lerobot",
            "3.12",
            ["-r", str(HERE / "lerobot.txt")],
            ["--no-deps", "-r", str(HERE / "lerobot_alone.txt")],
        ),
        "recorder": lambda: environment(
            folder / "recorder",
            "3.12",
            ["-r", str(HERE / "lerobot_record.txt")],
            ["--no-deps", "-r", str(HERE / "lerobot_record_alone.txt")],
        ),
    }
    for name in own:
        path = getattr(given, name)
        if path is not None:
            own[name] = lambda path=path: Path(path).absolute()
    return own


def bring_up_lo():
    """Brings up the namespace's own loopback interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as handle:
        fcntl.ioctl(handle, SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", IFF_UP))


def wait_until_served(bridge, log):
    """Waits until every robot has printed its address."""
    deadline_s = time.monotonic() + STARTING_S
    while "DDS domain" not in log.read_text():
        if bridge.poll() is not None or time.monotonic() > deadline_s:
            raise SystemExit(f"the bridge does not serve:\n{log.read_text()}")
        time.sleep(0.2)
    time.sleep(2.0)


def inside(case, pythons):
    """Runs one case; this process is alone in its namespace."""
    bring_up_lo()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bridge.txt"
        with log.open("w") as output:
            words = [pythons["bridge"], "-m", "tandem_unitree", *case.bridge, "--runs", f"{folder}/runs"]
            bridge = subprocess.Popen(words, stdout=output, stderr=output, cwd=folder)
        try:
            wait_until_served(bridge, log)
            clients = [
                subprocess.Popen([pythons[name], str(HERE / "clients" / script), *arguments], cwd=folder)
                for name, script, *arguments in case.clients
            ]
            statuses = [client.wait(MAX_CLIENT_S) for client in clients]
        finally:
            bridge.send_signal(signal.SIGTERM)
            bridge.wait(20)
            print("".join(f"    {line}\n" for line in log.read_text().splitlines() if line.startswith("robot ")), end="")
    return 0 if not any(statuses) else 1


def run(name, makers, made):
    """Runs one case in a separate namespace. Returns True if it has passed."""
    case = CASES[name]
    if case.needs_variable is not None and case.needs_variable not in os.environ:
        raise Skipped(f"{case.needs_variable} is not set")
    library = case.needs_library
    if library is not None and not (ctypes.util.find_library(library) or os.environ.get("TURBOJPEG")):
        raise Skipped(f"no lib{library}")
    for needed in sorted(case.environments - set(made)):
        made[needed] = makers[needed]()
    alone = ["unshare", "--net"] if os.geteuid() == 0 else ["unshare", "--net", "--user", "--map-root-user"]
    command(*alone, "true")
    pythons = [f"--{which}={path}" for which, path in made.items()]
    return subprocess.run([*alone, sys.executable, __file__, "--inside", *pythons, name], check=False).returncode == 0


def main():
    own = argparse.ArgumentParser()
    own.add_argument("names", nargs="*", default=list(CASES), metavar="NAME", help=", ".join(CASES))
    own.add_argument("--wheel", help="Tandem's wheel")
    own.add_argument("--environments", default="target/unitree")
    for which in ENVIRONMENTS:
        own.add_argument(f"--{which}", help=f"interpreter of an environment {which} that is there already")
    own.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    given = own.parse_args()
    if given.inside:
        [name] = given.names
        sys.exit(inside(CASES[name], {which: getattr(given, which) for which in ENVIRONMENTS}))
    makers, made, failed = environments(given), {}, []
    for name in given.names:
        print(f"{name}:", flush=True)
        try:
            if not run(name, makers, made):
                failed.append(name)
        except Skipped as reason:
            print(f"skipped: {name}: {reason}", file=sys.stderr, flush=True)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
