"""This process as a node of ROS 1: what it has registered with the master, again with each master that comes.

rospy has one node for each process and for good: the first that is opened decides about master and address. Its calls
to the master wait until there is one, so they are made on a thread of their own, and only while a master answers.
"""

from __future__ import annotations

import http.client
import logging
import os
import queue
import threading
import xmlrpc.client
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from urllib.parse import SplitResult, urlsplit
from xml.parsers.expat import ExpatError

from grounding.ros1.installed import ros
from kb.errors import ConcertmasterError

_LOOK_S = 1.0
_ANSWER_S = 2.0
_NAME = "concertmaster"


class BadMaster(ConcertmasterError):
    """An address is none of a master, or not that of the master which this process has a node with already."""

    fault = "request"


class MasterRefuses(ConcertmasterError):
    """The master is there but does not do what it is asked, such as to tell of a service that nobody offers."""

    fault = "world"


@dataclass(frozen=True, slots=True, kw_only=True)
class Master:
    """Where a master is, and how others find us.

    Attributes:
        uri: Such as `http://amigo-1:11311`, in ROS the variable `ROS_MASTER_URI`.
        host: Name or address of this computer that the robots can reach, in ROS `ROS_IP` or `ROS_HOSTNAME`; empty if
            ROS shall choose.
    """

    uri: str
    host: str = ""


class Node:
    """Registrations of one owner in the node of this process, from `open` to `close`.

    Args:
        complain: Told, on the node's thread, what could not be registered and why.
        changed: Told, on the node's thread, that the master is there, or that it is not.

    Attributes:
        connected: Whether the master has answered when it was asked last, a second ago or less.
        problem: Why it has not; empty if it has.

    Raises:
        BadMaster: The address is none, or another than that of this process's node.
        DependencyMissing: ROS 1 is not installed.
    """

    def __init__(
        self, master: Master, *, complain: Callable[[str], None], changed: Callable[[], None] = lambda: None
    ) -> None:
        address = urlsplit(master.uri)
        if address.scheme != "http" or not address.hostname or not _has_port(address):
            raise BadMaster(f"{master.uri!r} is no address of a master; one is http://amigo-1:11311")
        self._rospy = ros("rospy")
        _choose(master, self._rospy)
        self.master, self._complain, self._changed = master, complain, changed
        self.connected, self.problem = False, f"there has been no answer yet of the master at {master.uri}"
        self._pid: int | None = None
        self._held: dict[Hashable, tuple[Callable[[], Any], Callable[[Any], None], Any]] = {}
        self._jobs: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="ros1 node", daemon=True)

    @property
    def name(self) -> str:
        """The name of the node, the same in no other process; known from when it has been connected once."""
        return str(self._rospy.get_caller_id())

    def open(self) -> None:
        """Begin to look for the master."""
        self._thread.start()

    def close(self) -> None:
        """Take everything back that is registered, if the master is there; the node itself stays."""
        self._closing = True
        self.do(lambda: None)
        self._thread.join(_ANSWER_S + _LOOK_S)

    def do(self, job: Callable[[], None]) -> None:
        """Do something on the node's thread once the master is there, in the order in which it was asked for."""
        self._jobs.put(job)

    def hold(self, key: Hashable, make: Callable[[], Any], end: Callable[[Any], None]) -> None:
        """Register something, with every master that comes; what has the same key before is ended.

        Args:
            make: Registers it; run on the node's thread.
            end: Ends what `make` gave; it may raise what rospy raises.
        """

        def job() -> None:
            self._end(key)
            self._make(key, make, end)

        self.do(job)

    def drop(self, key: Hashable) -> None:
        """End what is registered under a key, if there is something."""
        self.do(lambda: self._end(key))

    def held(self, key: Hashable) -> Any | None:
        """What is registered under a key; None while it is not."""
        found = self._held.get(key)
        return None if found is None else found[2]

    def ask(self, method: str, *arguments: str) -> Any:
        """What the master answers to a call of its API, from any thread.

        Raises:
            MasterRefuses: It answers that it can't.
            OSError: It is not there, or does not answer in time.
        """
        caller: Any = xmlrpc.client.ServerProxy(self.master.uri, transport=_Limited())
        try:
            with caller:
                code, told, value = getattr(caller, method)(self.name, *arguments)
        except (xmlrpc.client.Error, http.client.HTTPException, ExpatError, TypeError, ValueError) as error:
            raise OSError(f"what answers at {self.master.uri} is no master: {error}") from error
        if code != 1:
            raise MasterRefuses(str(told))
        return value

    def offered(self) -> frozenset[str]:
        """The names of all services that the master knows; raises as `ask`."""
        return frozenset(service for service, _ in self.ask("getSystemState")[2])

    def _run(self) -> None:
        waiting: list[Callable[[], None]] = []
        while not self._closing:
            self._look()
            while waiting and self.connected:
                waiting.pop(0)()
            with suppress(queue.Empty):
                waiting.append(self._jobs.get(timeout=_LOOK_S))
        if self.connected:
            for key in list(self._held):
                self._end(key)

    def _look(self) -> None:
        """Find out whether the master is there, and whether it is the same as before."""
        before = (self.connected, self.problem)
        try:
            pid = int(self.ask("getPid"))
            if not self._rospy.core.is_initialized():
                _join(self._rospy)
        except (OSError, MasterRefuses) as error:
            self.connected, self.problem = False, f"the master at {self.master.uri} does not answer: {error}"
        else:
            renewed = self._pid not in (None, pid)
            self._pid, self.connected, self.problem = pid, True, ""
            if renewed:
                self._resume()
        if before != (self.connected, self.problem):
            self._changed()

    def _resume(self) -> None:
        """Register everything with a master that does not know us."""
        for key, (make, end, _) in list(self._held.items()):
            self._end(key)
            self._make(key, make, end)

    def _make(self, key: Hashable, make: Callable[[], Any], end: Callable[[Any], None]) -> None:
        try:
            self._held[key] = (make, end, make())
        except _failures(self._rospy) as error:
            self._complain(f"{key} cannot be registered: {error}")

    def _end(self, key: Hashable) -> None:
        if key in self._held:
            _, end, registered = self._held.pop(key)
            with suppress(*_failures(self._rospy)):
                end(registered)


def _failures(rospy: Any) -> tuple[type[Exception], ...]:
    """What rospy raises where a name cannot be had, or the master goes while it is asked."""
    return (rospy.ROSException, rospy.ServiceException, OSError, ValueError, xmlrpc.client.Error)


class _Limited(xmlrpc.client.Transport):
    """Does not wait for a master for ever, as rospy does."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _ANSWER_S
        return connection


def _has_port(address: SplitResult) -> bool:
    try:
        return bool(address.port)
    except ValueError:
        return False


_first = threading.Lock()


def _choose(master: Master, rospy: Any) -> None:
    """Say which master the node of this process is for, in the variables that rospy reads."""
    with _first:
        if rospy.core.is_initialized() or rospy.client._init_node_args:
            now = ros("rosgraph").get_master_uri()
            if now != master.uri:
                told = f"this process has a node with the master at {now}, and rospy has one node for each process"
                raise BadMaster(f"{master.uri}: {told}; use another process")
        os.environ["ROS_MASTER_URI"] = master.uri
        if master.host:
            os.environ["ROS_IP"] = master.host


def _join(rospy: Any) -> None:
    """Make this process a node."""
    with _first:
        if not rospy.core.is_initialized():
            rospy.init_node(
                _NAME, argv=[_NAME], anonymous=True, disable_signals=True, disable_rostime=True, disable_rosout=True
            )
            logging.getLogger("rosout").propagate = False
