"""Faults on the way to services and back, by schedule or by chance: for tests, campaigns and what-if runs.

A topic meets one of them only, that nothing comes through; who listens to it makes no calls.

Whatever carries the calls, the executive meets the same faults; the same seed gives the same ones. In a TOML file:

    [faults.camera_fails_once]
    service = "/amigo_1/kinect"     # names of services, actions and topics, with * and ?
    kind = "fail"                   # fail, hang, silence, delay, repeat, cut
    calls = [1]                     # which of the calls to such services; all if left out
    code = "SensorSilent"           # failure that is told

    [faults.amigo_is_lost]
    service = "/amigo_1/*"
    kind = "cut"
    from_s = 3.0                    # and until_s

    [faults.slow_network]
    service = "*"
    kind = "delay"
    probability = 0.1
    delay_s = 0.5
"""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum, auto
from pathlib import Path
from typing import assert_never

import numpy as np

from grounding.actions import Carrier, Goal, GoalResult, GoalStatus
from grounding.topics import Heard
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Callback, Clock
from kb.errors import BadFile
from kb.section import Section, read_file


class FaultKind(StrEnum):
    """What goes wrong with a call, or with a goal of an action."""

    FAIL = auto()
    """The service is not called; it is said to have failed."""
    HANG = auto()
    """The service is not called, and no reply comes."""
    SILENCE = auto()
    """The service does what it is asked to, but its reply is lost."""
    DELAY = auto()
    """The reply comes later."""
    REPEAT = auto()
    """The reply comes twice."""
    CUT = auto()
    """Nothing comes through: no calls, no replies to earlier ones, no messages of topics."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Which calls meet a fault, and which.

    Attributes:
        service: Names of services, actions and topics, with `*` and `?` as in file names.
        calls: Which of the calls to such services, counted from 1 by this fault; all if empty.
        from_s: From this time of the clock.
        until_s: Before this time.
        probability: Of meeting it, for each of these calls.
        code: Class of failure that is told (FAIL).
        delay_s: How much later the reply comes (DELAY); the second one (REPEAT).
    """

    service: str
    kind: FaultKind
    calls: frozenset[int] = frozenset()
    from_s: float = 0.0
    until_s: float = math.inf
    probability: float = 1.0
    code: str = "Injected"
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise ValueError(f"probability {self.probability:g} is not from 0 to 1")
        if not (self.delay_s >= 0.0 and math.isfinite(self.delay_s)):
            raise ValueError(f"delay_s {self.delay_s:g} is no time span")

    def concerns(self, service: str, t_s: float) -> bool:
        """Whether a call to a service at a time may meet it."""
        return self.from_s <= t_s < self.until_s and fnmatch.fnmatchcase(service, self.service)


class FaultyTransport:
    """A transport on which faults happen. Where several concern a call, the first that strikes counts.

    Args:
        chance: Decides where probabilities are not 0 or 1.
    """

    def __init__(self, transport: Carrier, clock: Clock, faults: Sequence[Fault], chance: np.random.Generator) -> None:
        self._transport = transport
        self._clock = clock
        self._faults = tuple(faults)
        self._chance = chance
        self._counts = [0] * len(self._faults)
        self._actions: dict[int, str] = {}

    def call(self, call: ServiceCall, deliver: Callable[[ServiceReply], None]) -> None:
        def come_through(reply: ServiceReply) -> None:
            if not self._is_cut(call.service):
                deliver(reply)

        fault = self._fault_of(call.service)
        if fault is None:
            self._transport.call(call, come_through)
            return

        def come_later(reply: ServiceReply) -> None:
            self._clock.call_at(self._clock.now_s + fault.delay_s, lambda: come_through(reply))

        def come_twice(reply: ServiceReply) -> None:
            come_through(reply)
            come_later(reply)

        match fault.kind:
            case FaultKind.FAIL:
                reason = f"{call.service} fails: a fault that was asked for"
                failed = ServiceReply(call_id=call.id, fields={}, failure=fault.code, reason=reason)
                self._clock.call_at(self._clock.now_s, lambda: come_through(failed))
            case FaultKind.HANG | FaultKind.CUT:
                pass
            case FaultKind.SILENCE:
                self._transport.call(call, lambda reply: None)
            case FaultKind.DELAY:
                self._transport.call(call, come_later)
            case FaultKind.REPEAT:
                self._transport.call(call, come_twice)
            case _:
                assert_never(fault.kind)

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        def come_through(offered: Mapping[int, bool | None]) -> None:
            told({call.id: not self._is_cut(call.service) and offered[call.id] for call in asked})

        asked = tuple(calls)
        self._transport.reconcile(asked, come_through)

    def send_goal(
        self, goal: Goal, feedback: Callable[[Mapping[str, object]], None], done: Callable[[GoalResult], None]
    ) -> None:
        def come_through(result: GoalResult) -> None:
            if not self._is_cut(goal.action):
                self._actions.pop(goal.id, None)
                done(result)

        def feed_through(fields: Mapping[str, object]) -> None:
            if not self._is_cut(goal.action):
                feedback(fields)

        self._actions[goal.id] = goal.action
        fault = self._fault_of(goal.action)
        delay_s = fault.delay_s if fault is not None else 0.0

        def come_later(result: GoalResult) -> None:
            self._clock.call_at(self._clock.now_s + delay_s, lambda: come_through(result))

        def come_twice(result: GoalResult) -> None:
            come_through(result)
            come_later(result)

        match fault.kind if fault is not None else None:
            case None:
                self._transport.send_goal(goal, feed_through, come_through)
            case FaultKind.FAIL:
                assert fault is not None
                failed = GoalResult(
                    goal_id=goal.id,
                    status=GoalStatus.ABORTED,
                    fields={},
                    failure=fault.code,
                    reason=f"{goal.action} fails: a fault that was asked for",
                )
                self._clock.call_at(self._clock.now_s, lambda: come_through(failed))
            case FaultKind.HANG | FaultKind.CUT:
                pass
            case FaultKind.SILENCE:
                self._transport.send_goal(goal, lambda fields: None, lambda result: None)
            case FaultKind.DELAY:
                self._transport.send_goal(goal, feed_through, come_later)
            case FaultKind.REPEAT:
                self._transport.send_goal(goal, feed_through, come_twice)
            case kind:
                assert_never(kind)

    def cancel_goal(self, goal_id: int) -> None:
        if not self._is_cut(self._actions.get(goal_id, "")):
            self._transport.cancel_goal(goal_id)

    def hear_topic(self, topic: str, message_type: str, heard: Heard) -> Callback:
        def come_through(message: object, problem: str) -> None:
            if not self._is_cut(topic):
                heard(message, problem)

        return self._transport.hear_topic(topic, message_type, come_through)

    def _fault_of(self, service: str) -> Fault | None:
        """The first fault that strikes this call or goal; each one that concerns it counts it."""
        struck = None
        for place, fault in enumerate(self._faults):
            if fault.concerns(service, self._clock.now_s):
                self._counts[place] += 1
                counted = not fault.calls or self._counts[place] in fault.calls
                if counted and (fault.probability == 1.0 or self._chance.random() < fault.probability):
                    struck = struck or fault
        return struck

    def _is_cut(self, service: str) -> bool:
        return any(f.kind is FaultKind.CUT and f.concerns(service, self._clock.now_s) for f in self._faults)


class BadFaults(BadFile):
    """A file of faults is wrong."""


def read_faults(file: Path) -> tuple[Fault, ...]:
    """The faults of a file, in its order.

    Raises:
        BadFaults: It is wrong.
    """
    top = read_file(file, BadFaults)
    faults = tuple(_fault(section) for _, section in top.sections("faults"))
    top.end()
    return faults


def _fault(section: Section) -> Fault:
    given = {}
    for name, low, high in (("from_s", 0.0, math.inf), ("until_s", 0.0, math.inf), ("probability", 0.0, 1.0)):
        if section.has(name):
            given[name] = section.number(name, low=low, high=high)
    fault = Fault(
        service=section.text("service"),
        kind=FaultKind(section.text("kind", choices=list(FaultKind))),
        calls=frozenset(section.integers("calls", low=1)) if section.has("calls") else frozenset(),
        code=section.text("code") if section.has("code") else "Injected",
        delay_s=section.number("delay_s", low=0.0) if section.has("delay_s") else 0.0,
        **given,
    )
    section.end()
    return fault
