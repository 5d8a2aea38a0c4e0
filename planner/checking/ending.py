"""When a program has ended, and how far it goes where only acting tells how it goes on.

Composite processes end as soon as they can, and so does what has a deadline, and a choice that leaves
nothing to do. All else ends when what follows it begins.
"""

from __future__ import annotations

from kb.terms import Struct, Term
from planner.checking.constructs import Constructs
from planner.checking.knowledge import Knowledge
from planner.checking.moment import Binding, CannotCheck, Moment, OnlyActingTells, bound
from planner.checking.remainder import DONE, Limited, Node, Ranked, Row, Running, Scope, Side, Todo, frame_of
from planner.checking.starting import Refused, Stage


class Ending:
    """Steps through a program as far as it goes without a step."""

    def __init__(self, constructs: Constructs, knowledge: Knowledge, stage: Stage) -> None:
        self._constructs = constructs
        self._knowledge = knowledge
        self._stage = stage

    def settle(self, node: Node, moment: Moment, frames: frozenset[str] | None) -> tuple[Node, Moment]:
        """What remains after steps have ended: composite processes whose body is done end, and so on.

        Args:
            frames: Frames of the steps that have ended; None to look everywhere.
        """
        while True:
            node, after = self._settled(node, moment, frames)
            if after is moment:
                return node, after
            moment, frames = after, frozenset()  # what is different now may let something else end

    def _settled(self, node: Node, moment: Moment, frames: frozenset[str] | None) -> tuple[Node, Moment]:
        read = self._constructs
        match node:
            case Running(step_id):
                return (node if step_id in moment.running else DONE), moment
            case Row(first, rest):
                part, after = self._settled(first, moment, frames)
                if part is DONE:
                    return self._settled(read.row(DONE, rest), after, None)
                return (node if part is first else Row(part, rest)), after
            case Side(parts):
                return self._settled_side(node, list(parts) if frames is None else node.around(frames), moment, frames)
            case Ranked(ranked):
                left = []
                for part in ranked:
                    after_part, moment = self._settled(part, moment, frames)
                    left += [] if after_part is DONE else [after_part]
                # Interrupts wait for what else there is; alone they end.
                return (DONE if all(map(_is_interrupt, left)) else Ranked(tuple(left))), moment
            case Scope(process_id, name, arguments, body):
                part, after = self._settled(body, moment, frames)
                ended = self.ended(part, after)
                if ended is not None:
                    return DONE, self._stage.end_process(process_id, name, arguments, ended)
                return (node if part is body else Scope(process_id, name, arguments, part)), after
            case Limited(by_ms, body):
                part, after = self._settled(body, moment, frames)
                ended = self.ended(part, after) if moment.now_ms <= by_ms else None
                return (DONE, ended) if ended is not None else (Limited(by_ms, part), after)
            case Todo():
                return self._decided(node, moment) if node is not DONE and read.restless(node) else (node, moment)

    def _decided(self, todo: Todo, moment: Moment) -> tuple[Node, Moment]:
        """What remains of what has not begun; a choice for what has no steps is taken as soon as it can be."""
        read = self._constructs
        match todo.term:
            case Struct("call"):
                ended = self.ended(todo, moment)
                return (todo, moment) if ended is None else (DONE, ended)
            case Struct("star"):
                enough = read.enough(todo, moment, free=False)
                return (todo, moment) if enough is None else (DONE, enough)
            case Struct("any_order"):
                parts = [
                    (part, read.node(rest.term, rest.binding), after)
                    for part, rest, after in read.next_parts(todo, moment, free=False)
                ]
            case _:
                parts = [(chosen, DONE, after) for chosen, after in read.chosen(todo, moment, free=False)]
        for part, rest, after in parts:
            left, settled = self._settled(part, after, None)
            passed = settled if left is DONE else self.ended(left, settled) if frame_of(left) is None else None
            if passed is not None:
                return self._settled(rest, passed, None)
        return todo, moment

    def _settled_side(
        self, node: Side, numbers: list[int], moment: Moment, frames: frozenset[str] | None
    ) -> tuple[Node, Moment]:
        left: Node = node
        for number in sorted(node.restless.union(numbers)):
            part = node.parts[number]
            settled, moment = self._settled(part, moment, frames)
            if settled is not part and isinstance(left, Side):
                left = left.changed(number, settled, restless=self._constructs.restless(settled))
        return left, moment

    def ended(self, node: Node, moment: Moment, *, free: bool = False) -> Moment | None:
        """The moment after a program has ended without another step; None if it cannot.

        Args:
            free: It may choose as it likes; else along the plan.
        """
        match node:
            case Todo(term, _):
                return self._ended_term(node, moment, free) if term else moment
            case Running(step_id):
                return None if step_id in moment.running else moment
            case Row(first, rest):
                after = self.ended(first, moment, free=free)
                return None if after is None else self.ended(self._constructs.row(DONE, rest), after, free=free)
            case Side(parts):
                return self._all_ended(list(parts.values()), moment, free)
            case Ranked(ranked):
                return self._all_ended(list(ranked), moment, free)
            case Scope(process_id, name, arguments, body):
                after = self.ended(body, moment, free=free)
                return None if after is None else self._stage.end_process(process_id, name, arguments, after)
            case Limited(by_ms, body):
                return self.ended(body, moment, free=free) if moment.now_ms <= by_ms else None

    def _all_ended(self, parts: list[Node], moment: Moment, free: bool) -> Moment | None:
        after: Moment | None = moment
        for part in parts:
            if after is None:
                return None
            after = self.ended(part, after, free=free)
        return after

    def _ended_term(self, todo: Todo, moment: Moment, free: bool) -> Moment | None:
        read = self._constructs
        if not read.passable(todo):
            return None
        try:
            match todo.term:
                case Struct("call", (frame, step, head)):
                    return self._ended_call(f"{bound(frame, todo.binding)}/{step}", head, todo.binding, moment, free)
                case Struct("choice" | "pick"):
                    ways = (
                        self.ended(chosen, after, free=free) for chosen, after in read.chosen(todo, moment, free=free)
                    )
                    return next((way for way in ways if way is not None), None)
                case Struct("foreach"):
                    return self.ended(read.turns(todo, moment), moment, free=free)
                case Struct("if"):
                    return self.ended(read.branch(todo, moment), moment, free=free)
                case Struct("while", (condition, body)):
                    if not self._knowledge.holds(condition, todo.binding, moment):
                        return moment
                    return self.ended(read.node(body, todo.binding), moment, free=free)
                case Struct("until", (body, condition)):
                    after = self.ended(read.node(body, todo.binding), moment, free=free)
                    return after if after and self._knowledge.holds(condition, todo.binding, after) else None
                case Struct("test", (condition,)):
                    return moment if self._knowledge.holds(condition, todo.binding, moment) else None
                case Struct("star"):
                    return read.enough(todo, moment, free=free)
                case Struct("any_order", (_, _, parts, *_)):
                    return self._any_order_ended(todo, moment, free) if parts else moment
                case Struct("interrupt"):
                    return moment
                case _:
                    raise CannotCheck(f"no program: {todo.term}")
        except OnlyActingTells:
            return None

    def _any_order_ended(self, todo: Todo, moment: Moment, free: bool) -> Moment | None:
        for part, rest, after in self._constructs.next_parts(todo, moment, free=free):
            passed = self.ended(part, after, free=free)
            ended = None if passed is None else self.ended(rest, passed, free=free)
            if ended is not None:
                return ended
        return None

    def _ended_call(self, call_id: str, head: Term, binding: Binding, moment: Moment, free: bool) -> Moment | None:
        """A composite process that has nothing to do begins and ends."""
        name, arguments = self._constructs.called(head, binding, moment)
        try:
            begun = self._stage.begin_process(call_id, name, arguments, moment)
        except Refused:
            return None
        after = self.ended(self._constructs.body(call_id, name, arguments), begun, free=free)
        return None if after is None else self._stage.end_process(call_id, name, arguments, after)

    # Where only acting tells how it goes on

    def halted(self, node: Node, moment: Moment) -> frozenset[str] | None:
        """The places of what only acting tells and on which all depends that has not ended; None if a step could come.

        Empty if the program has ended.
        """
        if self.ended(node, moment) is not None:
            return frozenset()
        match node:
            case Todo():
                return self._halted_term(node, moment)
            case Row(first, rest):
                after = self.ended(first, moment)
                if after is not None:
                    return self.halted(self._constructs.row(DONE, rest), after)
                return self.halted(first, moment)
            case Side(parts):
                return self._all_halted(list(parts.values()), moment)
            case Ranked(ranked):
                return self._all_halted(list(ranked), moment)
            case Scope(_, _, _, body) | Limited(_, body):
                return self.halted(body, moment)
            case Running():
                return None

    def _all_halted(self, parts: list[Node], moment: Moment) -> frozenset[str] | None:
        places: frozenset[str] = frozenset()
        for part in parts:
            more = self.halted(part, moment)
            if more is None:
                return None
            places |= more
        return places

    def _halted_term(self, todo: Todo, moment: Moment) -> frozenset[str] | None:
        read, knowledge = self._constructs, self._knowledge
        try:
            match todo.term:
                case Struct("test", (condition,)):
                    knowledge.holds(condition, todo.binding, moment)
                case Struct("if"):
                    return self.halted(read.branch(todo, moment), moment)
                case Struct("while", (condition, body)):
                    if knowledge.holds(condition, todo.binding, moment):
                        return self.halted(read.node(body, todo.binding), moment)
                case Struct("until", (body, condition)):
                    node = read.node(body, todo.binding)
                    after = self.ended(node, moment)
                    if after is None:
                        return self.halted(node, moment)
                    knowledge.holds(condition, todo.binding, after)
                case Struct("foreach"):
                    return self.halted(read.turns(todo, moment), moment)
                case Struct("choice" | "pick"):
                    for chosen, after in read.chosen(todo, moment, free=False):
                        return self.halted(chosen, after)
                case Struct("star" | "any_order"):
                    for part, rest, after in read.next_parts(todo, moment, free=False):
                        passed = self.ended(part, after)
                        return self.halted(part, after) if passed is None else self.halted(rest, passed)
                case Struct("call"):
                    opened = read.opened(todo, moment)
                    return None if opened is None else self.halted(opened, moment)
                case _:
                    return None
        except OnlyActingTells as tells:
            return frozenset({tells.place})
        return None


def _is_interrupt(node: Node) -> bool:
    return isinstance(node, Todo) and isinstance(node.term, Struct) and node.term.functor == "interrupt"
