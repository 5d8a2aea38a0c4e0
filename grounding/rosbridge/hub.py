"""A rosbridge server without its sockets: frames of clients in, frames to clients out.

    hub = Hub(clock)
    hub.services.offer("/amigo_1/laser", "concertmaster_msgs/Laser", laser, latency_s=0.008)
    session = hub.connect(send, close, role)     # a client comes
    hub.take(session, '{"op": "call_service", ...}')
    hub.leave(session)                           # and goes

Everything happens on one thread, that of the clock. What a client asks for and does not get is answered with the
reason; one client can neither hold up another nor take more than its allowance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime
from typing import assert_never

from grounding.rosbridge.framing import BadFrame
from grounding.rosbridge.hub_actions import Actions
from grounding.rosbridge.hub_services import Handler, Services
from grounding.rosbridge.hub_topics import Topics
from grounding.rosbridge.operations import (
    ActionFeedback,
    ActionResult,
    Advertise,
    AdvertiseAction,
    AdvertiseService,
    Auth,
    BadOperation,
    CallService,
    CancelActionGoal,
    Fragment,
    Operation,
    Png,
    Publish,
    SendActionGoal,
    ServiceResponse,
    SetLevel,
    Status,
    Subscribe,
    Unadvertise,
    UnadvertiseAction,
    UnadvertiseService,
    Unsubscribe,
    refusal,
)
from grounding.rosbridge.policy import Policy, Role
from grounding.rosbridge.rosapi import RosApi
from grounding.rosbridge.session import Close, Refused, Send, Session
from grounding.rosbridge.types import Types
from kb.clock import Clock, utc_now
from kb.errors import ConcertmasterError, ServiceFailed

NODE = "/concertmaster"
_MOST_NAME_CHARACTERS = 1000
AUTH_WAIT_S = 10.0
"""A client that has to say who it is and does not is sent away after this time."""


class Hub:
    """Who offers what and who wants what.

    Args:
        clock: Times of throttling and timeouts, and of the stamps of messages.
        types: Of the dialect; those of ROS 2 if None. Types of services are added to it.
        call_timeout_s: Of calls to clients that do not say how long they wait.
        calendar: Tells the date, for signed `auth`.

    Attributes:
        policy: Who may do what.
        types: All types that are known.
        topics: `topics.offer`, `say` and `listen` are for this process; likewise `services.offer`, `actions.offer`.
        params: Parameters of rosapi by name: texts of JSON.
    """

    def __init__(
        self,
        clock: Clock,
        *,
        policy: Policy | None = None,
        types: Types | None = None,
        call_timeout_s: float = 60.0,
        calendar: Callable[[], datetime] = utc_now,
    ) -> None:
        self.policy = policy or Policy()
        self.types = types or Types(2)
        self.topics = Topics(self.types, clock, NODE)
        self.services = Services(self.types, clock, NODE, call_timeout_s)
        self.actions = Actions(self.types, clock, NODE)
        self._clock, self._calendar = clock, calendar
        self._sessions: set[Session] = set()
        self._count = 0
        self.params: dict[str, str] = {}
        RosApi(clock, self.types, self.topics, self.services, self.actions, self.params, NODE).offer()
        log = "rcl_interfaces/Log" if self.types.ros_version == 2 else "rosgraph_msgs/Log"
        self.topics.offer("/rosout", log)

    @property
    def sessions(self) -> int:
        """How many clients are connected."""
        return len(self._sessions)

    def offer_service(
        self, name: str, request: Mapping[str, str], reply: Mapping[str, str], handler: Handler, latency_s: float
    ) -> None:
        """Offer a function as a service that has no standard type: it gets one, named for the end of its name.

        Args:
            name: Such as `/amigo_1/see_door`, whose type is `concertmaster_msgs/srv/SeeDoor`.
            request: ROS types by name of field: `sensor_msgs/LaserScan`, `bool`, `string[]`.
            reply: Likewise.
            handler: See `Services.offer`, as for `latency_s`.

        Raises:
            UnknownType: A field has no such type, or a service with the same end has other fields.
        """
        leaf = "".join(word.capitalize() for word in name.rpartition("/")[2].split("_"))
        self.services.offer(name, self.types.add_service_of(leaf, request, reply).name, handler, latency_s)

    def connect(self, send: Send, close: Close, role: Role | None) -> Session:
        """A client has come.

        Args:
            send: Takes what goes to it; must not wait.
            close: Ends its connection, with the reason; `leave` is then still to be called.
            role: None if it still has to say who it is, by `auth`.
        """
        self._count += 1
        now_s = self._clock.now_s
        session = Session(f"/client_{self._count}", role, self.policy.allowance, send, close, now_s)
        self._sessions.add(session)
        if role is None:
            self._clock.call_at(now_s + AUTH_WAIT_S, lambda: self._send_away_unknown(session))
        return session

    def leave(self, session: Session) -> None:
        """A client has gone; calling it again does nothing."""
        if session not in self._sessions:
            return
        self._sessions.remove(session)
        session.open = False
        self.topics.leave(session)
        self.services.leave(session)
        self.actions.leave(session)

    def take(self, session: Session, frame: str | bytes) -> None:
        """Do what the frame of a client says, or answer why not."""
        try:
            operation = session.decoder.feed(frame, self._clock.now_s)
        except BadOperation as bad:
            session.answer(refusal(bad.op, bad.id, bad.name or None, f"BadRequest: {bad.reason}"))
            return
        except BadFrame as bad:
            session.tell("error", f"BadRequest: {bad.reason}")
            return
        session.binary = session.binary or isinstance(frame, bytes)
        if operation is not None:
            self.do(session, operation, len(frame))

    def do(self, session: Session, operation: Operation, size: int = 0) -> None:
        """Do an operation of a client, or answer why not.

        Args:
            size: Of the frame that brought it, counted against the client's allowance.
        """
        try:
            session.spend(size, self._clock.now_s)
            self._check_role(session, operation)
            _check_names(operation)
            self._do(session, operation, size)
        except ServiceFailed as refused:
            self._refuse(session, operation, str(refused))
        except ConcertmasterError as wrong:  # a value or a type
            self._refuse(session, operation, f"BadRequest: {wrong}")

    def _check_role(self, session: Session, operation: Operation) -> None:
        if isinstance(operation, Auth):
            return
        if session.role is None:
            raise Refused("NotAllowed", "say first who you are: connect with a token, or send auth")
        if problem := session.role.objection(operation):
            raise Refused("NotAllowed", problem)

    def _do(self, session: Session, operation: Operation, size: int) -> None:
        match operation:
            case Publish():
                self.topics.publish(session, operation, size)
            case CallService():
                self.services.call(session, operation)
            case ServiceResponse():
                self.services.answered(session, operation)
            case Subscribe():
                self.topics.subscribe(session, operation)
            case Unsubscribe():
                self.topics.unsubscribe(session, operation)
            case Advertise():
                self.topics.advertise(session, operation)
            case Unadvertise():
                self.topics.unadvertise(session, operation)
            case AdvertiseService():
                self.services.advertise(session, operation)
            case UnadvertiseService():
                self.services.unadvertise(session, operation)
            case SendActionGoal():
                self.actions.send_goal(session, operation)
            case CancelActionGoal():
                self.actions.cancel(session, operation)
            case ActionFeedback():
                self.actions.fed(session, operation)
            case ActionResult():
                self.actions.ended(session, operation)
            case AdvertiseAction():
                self.actions.advertise(session, operation)
            case UnadvertiseAction():
                self.actions.unadvertise(session, operation)
            case SetLevel():
                session.level = operation.level
            case Auth():
                self._authenticate(session, operation)
            case Status():
                pass  # what a client has to tell; nobody here waits for it
            case Fragment() | Png():
                raise AssertionError("the decoder puts these together")
            case _:
                assert_never(operation)

    def _authenticate(self, session: Session, auth: Auth) -> None:
        if session.role is not None and not self.policy.secrets:
            return  # who does not need to say who it is may
        role = self.policy.role_of_signature(auth, self._calendar().timestamp())
        if role is None:
            session.tell("error", f"NotAllowed: auth as {auth.level!r} is not signed as it should be", auth.id)
            session.close("auth failed")
            return
        session.role = role

    def _send_away_unknown(self, session: Session) -> None:
        if session.open and session.role is None:
            session.close(f"did not say within {AUTH_WAIT_S:g} s who it is")

    def _refuse(self, session: Session, operation: Operation, reason: str) -> None:
        name = getattr(operation, "service", None) or getattr(operation, "action", None)
        answer = refusal(operation.OP, getattr(operation, "id", None), name, reason)
        if isinstance(answer, Status):
            session.tell(answer.level, answer.msg, answer.id)
        else:
            session.answer(answer)


def _check_names(operation: Operation) -> None:
    """What is kept of an operation while it is open has to be short."""
    for field in ("id", "topic", "service", "action", "type", "action_type"):
        length = len(str(getattr(operation, field, "")))
        if length > _MOST_NAME_CHARACTERS:
            raise Refused("BadRequest", f"field {field} has {length} characters, {_MOST_NAME_CHARACTERS} are allowed")
