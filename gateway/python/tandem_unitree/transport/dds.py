# pyright: basic, reportMissingImports=false
"""Topics of one robot in a DDS domain of its own, as serialized messages.

`cyclonedds` is of version 0.10, as Unitree's SDK needs it: programs that use 0.10 crash when they meet version 11.
"""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import quoteattr

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from tandem import TandemError

from ..robot.services import SERVICES
from . import idl

MAX_UNREAD = 64
"""Messages of a topic that are kept until they are read; older ones are dropped."""

_CONFIGURATION = """<CycloneDDS><Domain Id="any"><General><Interfaces>
<NetworkInterface name={interface} priority="default" multicast="default"/>
</Interfaces></General></Domain></CycloneDDS>"""

PUBLISHED: dict[str, Any] = {
    "rt/lowstate": idl.LowState_,
    "rt/lf/lowstate": idl.LowState_,
    "rt/secondary_imu": idl.IMUState_,
    "rt/odommodestate": idl.SportModeState_,
    "rt/lf/bmsstate": idl.BmsState_,
    "rt/dex3/left/state": idl.HandState_,
    "rt/dex3/right/state": idl.HandState_,
    **{f"rt/api/{service}/response": idl.Response_ for service in SERVICES},
}
"""Topics that a robot publishes."""

SUBSCRIBED: dict[str, Any] = {
    "rt/lowcmd": idl.LowCmd_,
    "rt/arm_sdk": idl.LowCmd_,
    "rt/dex3/left/cmd": idl.HandCmd_,
    "rt/dex3/right/cmd": idl.HandCmd_,
    **{f"rt/api/{service}/request": idl.Request_ for service in SERVICES},
}
"""Topics that a robot reads."""


class _Bytes(bytes):
    """A serialized message that was read; readers add the sample's info to it."""

    @classmethod
    def deserialize(cls, message: bytes) -> _Bytes:
        return cls(message)


class _Message:
    """A serialized message, which a writer takes in place of an object of its type."""

    def __init__(self, message: bytes) -> None:
        self._message = message

    def serialize(self, **_encoding: Any) -> bytes:
        return self._message


class Dds:
    """A robot's writers and readers.

    domain: Number of the DDS domain; robots are told apart by it and never by the interface.
    interface: Network interface, for example `lo`.
    """

    def __init__(self, domain: int, interface: str) -> None:
        try:
            self._domain = Domain(domain, _CONFIGURATION.format(interface=quoteattr(interface)))
            self._participant = DomainParticipant(domain)
        except DDSException as error:
            raise TandemError(
                f"domain {domain} on {interface!r} cannot be served; name an interface of this machine"
            ) from error
        self._writers = {name: self._writer(name, kind) for name, kind in PUBLISHED.items()}
        self._readers = {name: self._reader(name, kind) for name, kind in SUBSCRIBED.items()}

    def _writer(self, name: str, kind: Any) -> DataWriter:
        topic = Topic(self._participant, name, kind)
        writer = DataWriter(self._participant, topic)
        writer.data_type = _Message
        return writer

    def _reader(self, name: str, kind: Any) -> DataReader:
        topic = Topic(self._participant, name, kind)
        reader = DataReader(self._participant, topic, qos=Qos(Policy.History.KeepLast(MAX_UNREAD)))
        topic.data_type = _Bytes
        return reader

    def write(self, topic: str, message: bytes) -> None:
        """Publishes a serialized message."""
        self._writers[topic].write(_Message(message))

    def take(self, topic: str) -> list[bytes]:
        """Returns the messages of a topic that have come since the last call, oldest first."""
        return [message for message in self._readers[topic].take(MAX_UNREAD) if isinstance(message, bytes)]

    def close(self) -> None:
        """Leaves the domain."""
        self._writers.clear()
        self._readers.clear()
        del self._participant, self._domain
