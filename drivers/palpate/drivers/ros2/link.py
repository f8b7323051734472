"""Connection to a ROS 2 domain that reads one topic and writes commands to another, without waiting."""

import time
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from typing import Any, Final
from xml.sax.saxutils import quoteattr

from palpate.drivers.errors import GarbledError, SettingError, SilentError
from palpate.drivers.ros2.settings import COMMANDS, NAME, Ros2Network

EXTRA: Final = "pip install 'palpate[ros2]'"
_MOST: Final = 64
"""Maximum number of queued received messages; the oldest are dropped."""
_ENDPOINTS: Final = 500
_ACKNOWLEDGED_NS: Final = 100_000_000
"""Maximum wait for the robot to acknowledge the last command."""
_ALIVE: Final = 16
_EXISTS: Final = -4
_domains: Final = dict[int, tuple[str, Any]]()
"""Open domains. A process opens each domain once, and keeps it with its configuration."""


class Ros2Link:
    """DDS participant that reads one topic and, if requested, writes commands to another."""

    def __init__(self, network: Ros2Network, reads: tuple[str, str], writes: str = "") -> None:
        self.network, (self.reads, self.kind), self.writes = network, reads, writes
        self._participant: Any = None
        self._reader: Any = None
        self._writer: Any = None

    def open(self) -> None:
        """Join the domain, and start discovering other participants.

        Raises:
            SettingError: The library is missing, or this computer cannot join.
        """
        if find_spec("cyclonedds") is None:
            raise SettingError(NAME, "the package cyclonedds is not installed", EXTRA)
        from cyclonedds.core import DDSException

        try:
            _open_domain(self.network)
            self._join()
        except DDSException as error:
            self.close()
            problem = f"this computer cannot join domain {self.network.domain}: {_words(error)}"
            raise SettingError(NAME, problem, "check domain, address and peers in the rig file") from error

    def _join(self) -> None:
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from palpate.drivers.ros2.codec import TYPES, user_data

        def topic(name: str, kind: str) -> Any:
            return Topic(self._participant, _wire(name), TYPES[kind])

        def qos(reliability: Any, depth: int, kind: str) -> Qos:
            said = Policy.Userdata(user_data(kind))
            return Qos(reliability, Policy.Durability.Volatile, Policy.History.KeepLast(depth), said)

        self._participant = DomainParticipant(self.network.domain)
        wanted = qos(Policy.Reliability.BestEffort, _MOST, self.kind)
        self._reader = DataReader(self._participant, topic(self.reads, self.kind), wanted)
        if self.writes:
            # A newer command replaces an unsent one, so writing never waits.
            offered = qos(Policy.Reliability.Reliable(0), 1, COMMANDS)
            self._writer = DataWriter(self._participant, topic(self.writes, COMMANDS), offered)

    def take(self) -> list[Any]:
        """Return the messages received since the last call, oldest first; raises DriverError if one is invalid."""
        reader = self._opened(self._reader)
        try:
            taken = reader.take(_MOST)
        except Exception as error:
            # Invalid bytes raise various errors.
            raise GarbledError(NAME, f"a message of {self.reads} is no {self.kind}", "see who sends it") from error
        # A publisher that leaves the domain sends a sample without fields.
        return [each for each in taken if each.sample_info.valid_data]

    def write(self, values: Sequence[float]) -> None:
        """Publish a command; raises SilentError if that fails."""
        writer = self._opened(self._writer)
        from palpate.drivers.ros2.codec import command

        try:
            writer.write(command(list(values)))
        except Exception as error:
            raise SilentError(NAME, f"a command cannot be sent: {_words(error)}", "check the network") from error

    def publishers(self) -> int:
        """Return the number of compatible publishers on the topic being read."""
        return len(self._opened(self._reader).get_matched_publications())

    def subscribers(self) -> int:
        """Return the number of compatible command subscribers."""
        return len(self._opened(self._writer).get_matched_subscriptions())

    def endpoints(self, topic: str) -> list[tuple[str, str]]:
        """Return the type and quality of service of all publishers on the read topic or all command subscribers."""
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription

        kind = BuiltinTopicDcpsPublication if topic == self.reads else BuiltinTopicDcpsSubscription
        found = BuiltinDataReader(self._opened(self._participant), kind).read(_ENDPOINTS)
        alive = [
            each for each in found if each.sample_info.instance_state == _ALIVE and each.topic_name == _wire(topic)
        ]
        names = (each.type_name.replace("::dds_::", "::").replace("::", "/").removesuffix("_") for each in alive)
        return list(zip(names, (_qos_text(each.qos) for each in alive), strict=True))

    def wall_ns(self) -> int:
        """Return the time of day, which ROS 2 uses for timestamps."""
        return time.time_ns()

    def close(self) -> None:
        """Leave the domain; never raises."""
        if self._writer is not None:
            # Otherwise a hold command sent just before would not reach the robot.
            with suppress(Exception):
                self._writer.wait_for_acks(_ACKNOWLEDGED_NS)
        self._reader = self._writer = self._participant = None

    def _opened(self, entity: Any) -> Any:
        if entity is None:
            raise SilentError(NAME, "the link is closed", "open it again")
        return entity


def _open_domain(network: Ros2Network) -> None:
    """Open the domain in this process unless it is already open."""
    from cyclonedds.core import DDSException
    from cyclonedds.domain import Domain

    configuration = _configuration(network)
    if network.domain not in _domains:
        try:
            _domains[network.domain] = configuration, Domain(network.domain, configuration)
        except DDSException as error:
            # Other code in this process has already opened the domain with the library.
            if error.code != _EXISTS:
                raise
    elif _domains[network.domain][0] != configuration:
        problem = f"domain {network.domain} is open in this process with another address or other peers"
        raise SettingError(NAME, problem, "give arm and force sensor the same address and peers")


def _configuration(network: Ros2Network) -> str:
    general = discovery = ""
    if network.address:
        general = f"<Interfaces><NetworkInterface address={quoteattr(network.address)}/></Interfaces>"
    if network.peers:
        general += "<AllowMulticast>false</AllowMulticast>"
        peers = "".join(f"<Peer address={quoteattr(peer)}/>" for peer in network.peers)
        discovery = f"<ParticipantIndex>auto</ParticipantIndex><Peers>{peers}</Peers>"
    # Cyclone rejects descriptions of types by eProsima, vendor 1.15 (rmw_cyclonedds #535).
    types = "<IgnoreTypeInformation>1.15</IgnoreTypeInformation>"
    parts = (("General", general), ("Discovery", discovery), ("Compatibility", types))
    domain = "".join(f"<{name}>{content}</{name}>" for name, content in parts)
    return f"<CycloneDDS><Domain>{domain}</Domain></CycloneDDS>"


def _wire(topic: str) -> str:
    return f"rt/{topic.removeprefix('/')}"


def _qos_text(qos: Any) -> str:
    """Return the reliability and durability, which determine compatibility."""
    names = [str(policy).partition("(")[0].split(".") for policy in qos]
    return ", ".join(name[2] for name in names if name[1] in ("Reliability", "Durability"))


def _words(error: Exception) -> str:
    return " ".join(str(error).split())
