"""The operations of rosbridge v2, one value each, and their fields read one by one.

`read` makes an operation from the fields of a frame, `written` the fields from an operation; the round trip is exact.
What is right is said once, by the types of the fields below. Source: rosbridge v2 protocol specification, sections
2 and 3; ROS 1 specification for `auth`; `set_level` as clients send it.

Names of topics, services and actions are full (`/amigo_1/scan`). Types are as in ROS, `sensor_msgs/LaserScan` or
`sensor_msgs/msg/LaserScan`. An id names an exchange, not a message: it comes back in what answers.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from types import UnionType
from typing import Annotated, Any, ClassVar, Union, get_args, get_origin, get_type_hints

from grounding.rosbridge.wording import shown
from kb.errors import ConcertmasterError


class BadOperation(ConcertmasterError):
    """The fields of a frame are no operation.

    Attributes:
        reason: One sentence: which field, what it is, what it should be.
        op: The operation it was meant to be, or None if that is not known.
        id: Its id, or None if it has no usable one.
        name: The service of a call or the action of a goal, or None if it says none.
    """

    fault = "request"

    def __init__(self, reason: str, op: str | None, id: str | int | None, name: str | None = None) -> None:  # noqa: A002
        super().__init__(reason)
        self.reason, self.op, self.id, self.name = reason, op, id, name


@dataclass(frozen=True, slots=True)
class _Form:
    """What a field has to be: a test, and the words for it."""

    holds: Callable[[Any], bool]
    words: str


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: object) -> bool:
    # Not `isfinite`: it fails for whole numbers that no float holds.
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _one_of(*allowed: str) -> _Form:
    return _Form(lambda value: isinstance(value, str) and value in allowed, f"one of {', '.join(allowed)}")


Id = Annotated[str | int, _Form(lambda v: isinstance(v, str) or _is_whole(v), "a text or a whole number")]
Name = Annotated[str, _Form(lambda v: isinstance(v, str) and v != "", "a text that is not empty")]
Text = Annotated[str, _Form(lambda v: isinstance(v, str), "a text")]
Truth = Annotated[bool, _Form(lambda v: isinstance(v, bool), "true or false")]
Whole = Annotated[int, _Form(_is_whole, "a whole number")]
Count = Annotated[int, _Form(lambda v: _is_whole(v) and v >= 0, "a whole number from 0")]
Size = Annotated[int, _Form(lambda v: _is_whole(v) and v >= 1, "a whole number from 1")]
Number = Annotated[float, _Form(_is_number, "a finite number")]
Seconds = Annotated[float, _Form(lambda v: _is_number(v) and v > 0, "a number of seconds above 0")]
Tree = Annotated[Mapping[str, object], _Form(lambda v: isinstance(v, Mapping), "an object")]
Arguments = Annotated[
    Mapping[str, object] | list[object], _Form(lambda v: isinstance(v, Mapping | list), "an object or a list")
]
Values = Annotated[
    Mapping[str, object] | list[object] | str,
    _Form(lambda v: isinstance(v, Mapping | list | str), "an object, or a text that says why there is none"),
]
GoalStatusCode = Annotated[
    int, _Form(lambda v: _is_whole(v) and 0 <= v <= 6, "a status of action_msgs/GoalStatus, 0 to 6")
]
Level = Annotated[str, _one_of("info", "warning", "error", "none")]
Compression = Annotated[str, _one_of("none", "png", "cbor", "cbor-raw")]
ReplyCompression = Annotated[str, _one_of("none", "png", "cbor")]

ABORTED = 6
"""Status of a goal that failed (action_msgs/GoalStatus)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fragment:
    """Part `num` (from 0) of `total` of the text of another frame; all parts have the same id."""

    OP: ClassVar = "fragment"
    id: Id
    data: Text
    num: Count
    total: Size


@dataclass(frozen=True, slots=True, kw_only=True)
class Png:
    """The text of another frame in the bytes of a PNG image, in base64; perhaps in parts like fragments."""

    OP: ClassVar = "png"
    data: Text
    id: Id | None = None
    num: Count | None = None
    total: Size | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SetLevel:
    """From now on send only status messages of this level or worse."""

    OP: ClassVar = "set_level"
    level: Level
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """Something to be told; with an id if it is about an exchange."""

    OP: ClassVar = "status"
    level: Level
    msg: Text
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Auth:
    """Who the client is: the fields of rosauth, where `mac` signs the others. `t`, `end`: s since 1970."""

    OP: ClassVar = "auth"
    mac: Text
    client: Text
    dest: Text
    rand: Text
    t: Number
    level: Text
    end: Number
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Advertise:
    """The client is going to publish on a topic."""

    OP: ClassVar = "advertise"
    topic: Name
    type: Name
    id: Id | None = None
    latch: Truth = False
    queue_size: Count | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Unadvertise:
    """The client is not going to publish on a topic any more."""

    OP: ClassVar = "unadvertise"
    topic: Name
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Publish:
    """A message on a topic."""

    OP: ClassVar = "publish"
    topic: Name
    msg: Tree
    id: Id | None = None
    latch: Truth = False
    queue_size: Count | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Subscribe:
    """The client wants the messages of a topic, at most one in `throttle_rate` ms."""

    OP: ClassVar = "subscribe"
    topic: Name
    id: Id | None = None
    type: Name | None = None
    throttle_rate: Count = 0
    queue_length: Count = 0
    fragment_size: Size | None = None
    compression: Compression = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class Unsubscribe:
    """The end of one subscription, or without an id of all that the client has on the topic."""

    OP: ClassVar = "unsubscribe"
    topic: Name
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AdvertiseService:
    """The client offers a service."""

    OP: ClassVar = "advertise_service"
    service: Name
    type: Name
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class UnadvertiseService:
    """The client does not offer a service any more."""

    OP: ClassVar = "unadvertise_service"
    service: Name
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CallService:
    """A request, by name or in the order of the fields; `timeout` in s.

    `type` is what some clients send beside it. Compression cbor, of the reply, is more than the protocol has.
    """

    OP: ClassVar = "call_service"
    service: Name
    id: Id | None = None
    args: Arguments | None = None
    fragment_size: Size | None = None
    compression: ReplyCompression = "none"
    timeout: Seconds | None = None
    type: Text | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceResponse:
    """The reply; if `result` is false, `values` says why."""

    OP: ClassVar = "service_response"
    service: Name
    result: Truth
    id: Id | None = None
    values: Values | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AdvertiseAction:
    """The client offers an action."""

    OP: ClassVar = "advertise_action"
    action: Name
    type: Name
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class UnadvertiseAction:
    """The client does not offer an action any more."""

    OP: ClassVar = "unadvertise_action"
    action: Name
    id: Id | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SendActionGoal:
    """A goal, by name or in the order of the fields; answered by feedback if wanted, and one result."""

    OP: ClassVar = "send_action_goal"
    action: Name
    action_type: Name
    id: Id | None = None
    args: Arguments | None = None
    feedback: Truth = False
    fragment_size: Size | None = None
    compression: ReplyCompression = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelActionGoal:
    """The goal with this id is not wanted any more."""

    OP: ClassVar = "cancel_action_goal"
    action: Name
    id: Id


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionFeedback:
    """How far a goal has come."""

    OP: ClassVar = "action_feedback"
    action: Name
    id: Id
    values: Tree


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionResult:
    """How a goal ended; if `result` is false, `values` may say why."""

    OP: ClassVar = "action_result"
    action: Name
    status: GoalStatusCode
    result: Truth
    id: Id | None = None
    values: Values | None = None


Operation = (
    Fragment
    | Png
    | SetLevel
    | Status
    | Auth
    | Advertise
    | Unadvertise
    | Publish
    | Subscribe
    | Unsubscribe
    | AdvertiseService
    | UnadvertiseService
    | CallService
    | ServiceResponse
    | AdvertiseAction
    | UnadvertiseAction
    | SendActionGoal
    | CancelActionGoal
    | ActionFeedback
    | ActionResult
)

OPERATIONS: Mapping[str, type[Operation]] = {kind.OP: kind for kind in get_args(Operation)}
"""The operations by their name on the wire."""


def read(given: Mapping[str, object]) -> Operation:
    """The operation that the fields of a frame say.

    A null counts as a missing field, fields that the protocol does not know are passed over. Two old forms are put
    right: a service `name#id`, and the result of a failed goal without a status.

    Raises:
        BadOperation: A field is missing or wrong, or the operation is unknown.
    """
    op = given.get("op")
    if op is None:
        raise _bad(given, None, "field op is missing: it should name the operation, such as publish")
    if not isinstance(op, str) or op not in OPERATIONS:
        known = ", ".join(sorted(OPERATIONS))
        raise _bad(given, None, f"field op is {shown(op)}, which is no operation: there are {known}")
    given = _put_right(op, given)
    values: dict[str, Any] = {}
    for name, form, needed in _fields_of(op):
        value = given.get(name)
        if value is None:
            if needed:
                raise _bad(given, op, f"field {name} is missing, should be {form.words}")
        elif form.holds(value):
            values[name] = value
        else:
            raise _bad(given, op, f"field {name} is {shown(value)}, should be {form.words}")
    operation = OPERATIONS[op](**values)
    problem = _problem_in_parts(operation)
    if problem:
        raise _bad(given, op, problem)
    return operation


def written(operation: Operation) -> dict[str, object]:
    """The fields of an operation for a frame, `op` first; optional ones only where they say something."""
    result: dict[str, object] = {"op": operation.OP}
    for field in fields(operation):
        value = getattr(operation, field.name)
        if field.default is MISSING or value != field.default:
            result[field.name] = value
    return result


def refusal(op: str | None, id: str | int | None, name: str | None, reason: str) -> Operation:  # noqa: A002
    """What answers an operation that is not done: the reply that its sender waits for, or a status.

    Args:
        op: The operation; None if it is none.
        name: The service or action that it is about, if any.
    """
    if op == CallService.OP and name is not None:
        return ServiceResponse(service=name, id=id, result=False, values=reason)
    if op == SendActionGoal.OP and name is not None:
        return ActionResult(action=name, id=id, result=False, status=0, values=reason)
    return Status(level="error", msg=reason, id=id)


def _bad(given: Mapping[str, object], op: str | None, problem: str) -> BadOperation:
    """The error for wrong fields, with what of them can be used for an answer."""
    id_ = given.get("id")
    name = given.get("action" if op == SendActionGoal.OP else "service")
    return BadOperation(
        f"{op}: {problem}" if op else problem,
        op,
        id_ if isinstance(id_, str) or _is_whole(id_) else None,  # type: ignore[arg-type]
        name if isinstance(name, str) else None,
    )


@cache
def _fields_of(op: str) -> tuple[tuple[str, _Form, bool], ...]:
    """For each field of an operation its name, what it has to be, and whether it must be there."""
    kind = OPERATIONS[op]
    hints = get_type_hints(kind, include_extras=True)
    return tuple((field.name, _form_of(hints[field.name]), field.default is MISSING) for field in fields(kind))


def _form_of(hint: Any) -> _Form:
    """The form in `Annotated[..., form]`, which may stand in a union with None."""
    if get_origin(hint) in (Union, UnionType):
        hint = next(part for part in get_args(hint) if part is not type(None))
    form: _Form = hint.__metadata__[0]
    return form


def _put_right(op: str, given: Mapping[str, object]) -> Mapping[str, object]:
    service = given.get("service")
    if op == CallService.OP and isinstance(service, str) and "#" in service:
        name, _, id_ = service.partition("#")
        return {**given, "service": name, "id": id_ if given.get("id") is None else given["id"]}
    if op == ActionResult.OP and given.get("status") is None and given.get("result") is False:
        return {**given, "status": ABORTED}
    return given


def _problem_in_parts(operation: Operation) -> str:
    """What is wrong with the numbers of a frame in parts; empty if nothing is."""
    if not isinstance(operation, Fragment | Png):
        return ""
    num, total = operation.num, operation.total
    if num is None and total is None:
        return ""
    if num is None or total is None or operation.id is None:
        return "fields id, num and total belong together, one of them is missing"
    return "" if num < total else f"field num is {num}, should be below total, {total}"
