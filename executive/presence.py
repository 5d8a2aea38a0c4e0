"""Robots that do not answer: they are asked again and again until they do."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from executive.events import FactWasTold
from grounding.transport import ServiceCall, Transport
from kb.clock import Clock
from kb.history import SourceKind
from kb.vocabulary import Property

_ASKED_AGAIN_S = 1.0


class Presence:
    """Asks for robots whose connection was lost.

    Args:
        post: Told of each robot that is there again, once.
    """

    def __init__(self, transport: Transport, clock: Clock, post: Callable[[FactWasTold], None]) -> None:
        self._transport, self._clock, self._post = transport, clock, post
        self._lost = dict[str, ServiceCall]()

    def lose(self, robot: str, call: ServiceCall) -> None:
        """From now on, ask for a robot, which a call, or a goal, could not reach."""
        if robot not in self._lost:
            self._lost[robot] = call
            self._ask_later(robot)

    def _ask_later(self, robot: str) -> None:
        self._clock.call_at(self._clock.now_s + _ASKED_AGAIN_S, lambda: self._ask(robot))

    def _ask(self, robot: str) -> None:
        call = self._lost[robot]

        def told(offered: Mapping[int, bool | None]) -> None:
            if offered[call.id] is False:
                self._ask_later(robot)
                return
            del self._lost[robot]
            fact = FactWasTold(prop=Property.IS_REACHABLE, subject=robot, value=True, source=SourceKind.CONNECTION)
            self._post(fact)

        self._transport.reconcile([call], told)
