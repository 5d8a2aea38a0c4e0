"""The actions of a rosbridge server: those of this process, and those that clients offer.

A goal gets feedback, if it is wanted, and exactly one result: from its provider, or with the reason why there is none.
It goes on when it is canceled until its provider says that it has ended. The goals of a client that leaves are
canceled: nobody would hear of them any more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from grounding.actions import GoalStatus
from grounding.rosbridge.forms import BadValue
from grounding.rosbridge.operations import (
    ActionFeedback,
    ActionResult,
    AdvertiseAction,
    CancelActionGoal,
    SendActionGoal,
    UnadvertiseAction,
)
from grounding.rosbridge.policy import resolved
from grounding.rosbridge.session import Refused, Session, numbers_in
from grounding.rosbridge.types import ActionType, Types
from grounding.rosbridge.values import fields_from_tree, fields_to_tree
from kb.clock import Clock
from kb.errors import ConcertmasterError, ServiceFailed


class RunningGoal:
    """A goal of an action of this process, as who carries it out sees it.

    Attributes:
        fields: Of the goal: messages and plain values.
        canceled: Called when the goal is not wanted any more; it then ends by `end`, mostly as CANCELED.
    """

    def __init__(self, fields: Mapping[str, object], actions: Actions, number: str) -> None:
        self.fields = fields
        self.canceled: Callable[[], None] = lambda: None
        self._actions, self._number = actions, number

    def feed(self, fields: Mapping[str, object]) -> None:
        """Tell how far it has come; nothing happens if it has ended."""
        self._actions.feed_local(self._number, fields)

    def end(self, status: GoalStatus, fields: Mapping[str, object], reason: str = "") -> None:
        """Tell how it ended; nothing happens if it has ended before.

        Args:
            status: SUCCEEDED, CANCELED or ABORTED.
            reason: Why it was aborted, beginning with the class of failure: `Blocked: the door is closed`; told where
                there are no fields that tell it.
        """
        self._actions.end_local(self._number, status, fields, reason)


Start = Callable[[RunningGoal], None]
"""Begins to carry out a goal; raises ServiceFailed if it does not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Action:
    """Of this process, with `start`, or of a client."""

    type: ActionType
    start: Start | None = None
    provider: Session | None = None
    advertised_as: str = ""  # clients take goals by the very name that they gave


@dataclass(frozen=True, slots=True, kw_only=True)
class _Goal:
    """A goal that has not ended, without its arguments; `local` if it is carried out here."""

    id: str
    sender: Session
    asked: SendActionGoal
    action: _Action
    local: RunningGoal | None


class Actions:
    """All actions of a server.

    Args:
        node: Name of this process among the providers.

    Attributes:
        out_of_reach: Why actions that there are cannot be used, by name.
    """

    def __init__(self, types: Types, clock: Clock, node: str) -> None:
        self._types, self._clock, self._node = types, clock, node
        self.out_of_reach: Mapping[str, str] = {}
        self._actions: dict[str, _Action] = {}
        self._goals: dict[str, _Goal] = {}
        self._count = 0

    def offer(self, name: str, action_type: str, start: Start) -> None:
        """Offer an action of this process.

        Raises:
            UnknownType: There is no such type.
        """
        self._actions[resolved(name)] = _Action(type=self._types.action(action_type), start=start)

    def told(self) -> list[tuple[str, str, str]]:
        """Name, type and provider of all actions, by name."""
        return [
            (name, action.type.name, action.provider.name if action.provider else self._node)
            for name, action in sorted(self._actions.items())
        ]

    @property
    def open_goals(self) -> int:
        """How many goals have not ended."""
        return len(self._goals)

    def advertise(self, session: Session, operation: AdvertiseAction) -> None:
        action_type = self._types.action(operation.type)
        name = resolved(operation.action)
        present = self._actions.get(name)
        if present is not None and present.provider is not session:
            raise Refused("NameTaken", f"action {operation.action} is offered by somebody else")
        session.hold("action", name)
        self._actions[name] = _Action(type=action_type, provider=session, advertised_as=operation.action)

    def unadvertise(self, session: Session, operation: UnadvertiseAction) -> None:
        action = self._actions.get(resolved(operation.action))
        if action is None or action.provider is not session:
            session.tell("warning", f"action {operation.action} is not offered by this client", operation.id)
            return
        self._withdraw(resolved(operation.action), session)

    def send_goal(self, session: Session, operation: SendActionGoal) -> None:
        action = self._actions.get(resolved(operation.action))
        if action is None:
            why = self.out_of_reach.get(resolved(operation.action), "")
            raise Refused("NoSuchAction", why or f"there is no action {operation.action}")
        if self._types.action(operation.action_type) != action.type:
            problem = f"action {operation.action} has type {action.type.name}, not {operation.action_type}"
            raise Refused("BadRequest", problem)
        if operation.id is not None and self._of(session, operation.action, operation.id):
            raise Refused("BadRequest", f"a goal of {operation.action} with id {operation.id} has not ended yet")
        fields = fields_from_tree(action.type.goal, operation.args, now_s=self._clock.now_s, types=self._types)
        self._count += 1
        number = f"action_goal:{operation.action}:{self._count}"
        session.hold("goal", number)
        local = None if action.start is None else RunningGoal(fields, self, number)
        self._goals[number] = _Goal(
            id=number, sender=session, asked=replace(operation, args=None), action=action, local=local
        )
        if action.start is not None and local is not None:
            try:
                action.start(local)
            except ServiceFailed as failed:
                self.end_local(number, GoalStatus.ABORTED, {}, str(failed))
            except ConcertmasterError as wrong:
                self.end_local(number, GoalStatus.ABORTED, {}, f"BadRequest: {wrong}")
            return
        assert action.provider is not None
        encoding = action.provider.encoding("none")
        tree = fields_to_tree(action.type.goal, fields, numbers=numbers_in(encoding), types=self._types)
        # Feedback is always asked for, as rosbridge does; it goes on only to who wants it.
        forwarded = SendActionGoal(
            action=action.advertised_as, action_type=operation.action_type, id=number, args=tree, feedback=True
        )
        action.provider.answer(forwarded, compression=encoding)

    def cancel(self, session: Session, operation: CancelActionGoal) -> None:
        goal = self._of(session, operation.action, operation.id)
        if goal is None:
            raise Refused("NoSuchGoal", f"there is no open goal of {operation.action} with id {operation.id}")
        self._cancel(goal)

    def fed(self, session: Session, operation: ActionFeedback) -> None:
        goal = self._provided(session, operation.id)
        if goal is None:
            session.tell("warning", f"there is no open goal with id {operation.id}", operation.id)
            return
        feedback_type = goal.action.type.feedback
        fields = fields_from_tree(feedback_type, operation.values, now_s=self._clock.now_s, types=self._types)
        self._feed(goal, fields)

    def ended(self, session: Session, operation: ActionResult) -> None:
        goal = self._provided(session, operation.id)
        if goal is None:
            session.tell("warning", f"there is no open goal with id {operation.id}", operation.id)
            return
        status, given = GoalStatus(operation.status), operation.values
        if not operation.result:
            said = given if isinstance(given, str) and given else f"{operation.action} gave no reason"
            self._end(goal, status, said)
            return
        try:
            result_type = goal.action.type.result
            fields = fields_from_tree(result_type, given, now_s=self._clock.now_s, types=self._types)
        except BadValue as error:
            session.tell("warning", f"result of {operation.action}: {error}", operation.id)
            self._end(goal, GoalStatus.ABORTED, f"BadReply: {operation.action}: {error}")
            return
        self._end(goal, status, fields)

    def leave(self, session: Session) -> None:
        """The client is gone: what it offered ends, its own goals are canceled."""
        for name in [name for name, action in self._actions.items() if action.provider is session]:
            self._withdraw(name, session)
        for goal in [goal for goal in self._goals.values() if goal.sender is session]:
            self._cancel(goal)

    def feed_local(self, number: str, fields: Mapping[str, object]) -> None:
        """Feedback on a goal of this process; for RunningGoal."""
        if number in self._goals:
            self._feed(self._goals[number], fields)

    def end_local(self, number: str, status: GoalStatus, fields: Mapping[str, object], reason: str) -> None:
        """The result of a goal of this process; for RunningGoal."""
        if number in self._goals:
            self._end(self._goals[number], status, fields if fields or status is not GoalStatus.ABORTED else reason)

    def _of(self, session: Session, action: str, id_: str | int) -> _Goal | None:
        for goal in self._goals.values():
            if goal.sender is session and resolved(goal.asked.action) == resolved(action) and goal.asked.id == id_:
                return goal
        return None

    def _provided(self, session: Session, number: str | int | None) -> _Goal | None:
        goal = self._goals.get(str(number))
        return goal if goal is not None and goal.action.provider is session else None

    def _cancel(self, goal: _Goal) -> None:
        if goal.local is not None:
            goal.local.canceled()
        elif goal.action.provider is not None:
            goal.action.provider.answer(CancelActionGoal(action=goal.action.advertised_as, id=goal.id))

    def _feed(self, goal: _Goal, fields: Mapping[str, object]) -> None:
        if not goal.asked.feedback or goal.asked.id is None:
            return
        encoding = goal.sender.encoding(goal.asked.compression)
        tree = fields_to_tree(goal.action.type.feedback, fields, numbers=numbers_in(encoding), types=self._types)
        feedback = ActionFeedback(action=goal.asked.action, id=goal.asked.id, values=tree)
        goal.sender.answer(feedback, compression=encoding, fragment_size=goal.asked.fragment_size)

    def _end(self, goal: _Goal, status: GoalStatus, result: Mapping[str, object] | str) -> None:
        """Send the result, or the reason why there is none, and forget the goal."""
        del self._goals[goal.id]
        goal.sender.release("goal", goal.id)
        asked, encoding = goal.asked, goal.sender.encoding(goal.asked.compression)
        values = result
        if not isinstance(result, str):
            values = fields_to_tree(goal.action.type.result, result, numbers=numbers_in(encoding), types=self._types)
        answer = ActionResult(
            action=asked.action, id=asked.id, values=values, status=int(status), result=not isinstance(result, str)
        )
        goal.sender.answer(answer, compression=encoding, fragment_size=asked.fragment_size)

    def _withdraw(self, name: str, session: Session) -> None:
        del self._actions[name]
        session.release("action", name)
        for goal in [goal for goal in self._goals.values() if resolved(goal.asked.action) == name]:
            self._end(goal, GoalStatus.ABORTED, f"Lost: who offered action {name} is gone")
