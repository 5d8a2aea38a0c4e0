"""What a program lets begin: the checker's reading of every construct.

[ConGolog] 3 and 4, [IndiGolog] and OWL-S 1.2 say what the constructs mean. Conditions are asked in the
moment when the construct is reached: when a step of it begins, or when what follows it does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kb.terms import Action, Struct, Term
from planner.checking.constructs import Constructs
from planner.checking.demands import Demands
from planner.checking.ending import Ending
from planner.checking.knowledge import Knowledge
from planner.checking.moment import Binding, CannotCheck, Moment, OnlyActingTells, bound, shown
from planner.checking.remainder import DONE, Limited, Node, Ranked, Row, Running, Scope, Side, Todo
from planner.checking.starting import Refused, Stage, seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """A step that a plan starts now.

    Attributes:
        arguments: As plans show them.
        frames: All that its id may be in.
    """

    action: Action
    arguments: tuple[str, ...]
    frames: tuple[str, ...]
    start_ms: int
    end_ms: int


class Walk:
    """Steps through a program along a plan."""

    def __init__(
        self, constructs: Constructs, demands: Demands, knowledge: Knowledge, stage: Stage, ending: Ending
    ) -> None:
        self._constructs = constructs
        self._ending = ending
        self._demands = demands
        self._knowledge = knowledge
        self._stage = stage

    def begin(self, node: Node, moment: Moment, wanted: Wanted) -> Iterator[tuple[Node, Moment]]:
        """All ways in which a program starts a step now, and what remains then; `reasons` why there is none."""
        self.reasons.clear()
        return self._ways(node, moment, wanted)

    @property
    def reasons(self) -> list[str]:
        """What kept from beginning what was wanted last."""
        return self._constructs.reasons

    def _ways(self, node: Node, moment: Moment, wanted: Wanted | None) -> Iterator[tuple[Node, Moment]]:
        """All ways to start a step; any step, whatever is chosen, if none is wanted."""
        match node:
            case Todo():
                yield from self._ways_of(node, moment, wanted)
            case Row(first, rest):
                for part, after in self._ways(first, moment, wanted):
                    yield self._constructs.row(part, rest), after
                passed = self._ending.ended(first, moment, free=wanted is None)
                if passed is not None:
                    yield from self._ways(self._constructs.row(DONE, rest), passed, wanted)
            case Side(parts):
                for number in list(parts) if wanted is None else node.around(wanted.frames):
                    for part, after in self._ways(parts[number], moment, wanted):
                        yield node.changed(number, part, restless=self._constructs.restless(part)), after
            case Ranked():
                ranked, decided = self._ending.settle(node, moment, None)
                if isinstance(ranked, Ranked):
                    yield from self._ways_by_rank(ranked.parts, decided, wanted)
            case Scope(process_id, name, arguments, body):
                if wanted is None or wanted.action.id.startswith(f"{process_id}/"):
                    for part, after in self._ways(body, moment, wanted):
                        yield Scope(process_id, name, arguments, part), after
            case Limited(by_ms, body):
                for part, after in self._ways(body, moment, wanted):
                    end_ms = max(after.running[i].end_ms for i in after.running.keys() - moment.running.keys())
                    if end_ms <= by_ms:
                        yield Limited(by_ms, part), after
                    else:
                        self.reasons.append(f"it would end at {seconds(end_ms)}, after its deadline {seconds(by_ms)}")
            case Running():
                return

    def _ways_by_rank(
        self, parts: tuple[Node, ...], moment: Moment, wanted: Wanted | None
    ) -> Iterator[tuple[Node, Moment]]:
        for number, part in enumerate(parts):
            for begun, after in self._ways(part, moment, wanted):
                yield Ranked((*parts[:number], begun, *parts[number + 1 :])), after
            why = list(self.reasons)
            if any(True for _ in self._ways(part, moment, None)):
                could = any(True for later in parts[number + 1 :] for _ in self._ways(later, moment, wanted))
                self.reasons[:] = [*why, "something of higher priority could begin instead"] if could else why
                over = self._ending.ended(part, moment)
                if over is not None and over.taken != moment.taken:  # the plan has chosen, and so it is over
                    yield from self._ways_by_rank((*parts[:number], *parts[number + 1 :]), over, wanted)
                return
            self.reasons[:] = why

    def _ways_of(self, todo: Todo, moment: Moment, wanted: Wanted | None) -> Iterator[tuple[Node, Moment]]:
        read, free = self._constructs, wanted is None
        try:
            match todo.term:
                case Struct("call", (frame, step, head)):
                    call_id = f"{bound(frame, todo.binding)}/{step}"
                    if wanted is None or wanted.action.id == call_id or wanted.action.id.startswith(f"{call_id}/"):
                        yield from self._ways_of_call(call_id, head, todo.binding, moment, wanted)
                case Struct("choice" | "pick"):
                    for chosen, after in read.chosen(todo, moment, free=free):
                        yield from self._ways(chosen, after, wanted)
                case Struct("foreach"):
                    yield from self._ways(read.turns(todo, moment), moment, wanted)
                case Struct("if"):
                    yield from self._ways(read.branch(todo, moment), moment, wanted)
                case Struct("while", (condition, body)):
                    if self._knowledge.holds(condition, todo.binding, moment):
                        for turn, after in self._ways(read.node(body, todo.binding), moment, wanted):
                            yield read.row(turn, (todo,)), after
                case Struct("until", (body, condition)):
                    again = Todo(Struct("if", (condition, [], todo.term)), todo.binding)
                    for turn, after in self._ways(read.node(body, todo.binding), moment, wanted):
                        yield read.row(turn, (again,)), after
                case Struct("star" | "any_order" as construct):
                    for part, rest, after in read.next_parts(todo, moment, free=free):
                        for begun, later in self._ways(part, after, wanted):
                            yield read.row(begun, (rest,)), later
                        passed = self._ending.ended(part, after, free=free) if construct == "any_order" else None
                        if passed is not None:
                            yield from self._ways(rest, passed, wanted)
                case Struct("interrupt"):
                    turn_now = read.triggered(todo, moment)
                    if turn_now is not None:
                        for begun, after in self._ways(turn_now, moment, wanted):
                            yield read.row(begun, (todo,)), after
                case [] | Struct("test"):
                    return
                case _:
                    raise CannotCheck(f"no program: {todo.term}")
        except OnlyActingTells as tells:
            self.reasons.append(f"only acting tells {tells.place}, on which it depends")

    def _ways_of_call(
        self, call_id: str, head: Term, binding: Binding, moment: Moment, wanted: Wanted | None
    ) -> Iterator[tuple[Node, Moment]]:
        name, arguments = self._constructs.called(head, binding, moment)
        try:
            if self._demands.of(name).one_step:
                if wanted is not None:
                    self._must_match(wanted, call_id, name, arguments)
                after = self._stage.begin_step(call_id, name, arguments, moment)
                if wanted is not None and after.running[call_id].end_ms != wanted.end_ms:
                    takes_ms = after.running[call_id].end_ms - moment.now_ms
                    raise Refused(
                        f"{wanted.action} takes {seconds(takes_ms)}, not {seconds(wanted.end_ms - moment.now_ms)}"
                    )
                yield Running(call_id), after
                return
            after = self._stage.begin_process(call_id, name, arguments, moment)
        except Refused as refused:
            self.reasons.append(str(refused))
            return
        body = self._constructs.body(call_id, name, arguments)
        for part, later in self._ways(body, after, wanted):
            yield Scope(call_id, name, arguments, part), later

    def _must_match(self, wanted: Wanted, call_id: str, name: str, arguments: tuple[Term, ...]) -> None:
        asked, planned = tuple([shown(argument) for argument in arguments]), wanted.action
        robots = tuple([asked[n] for n in self._demands.of(name).robots])
        if planned.id != call_id or planned.process != name or wanted.arguments != asked:
            raise Refused(f"the plan does {planned} where the program asks for {name}({', '.join(asked)})")
        if planned.robots != robots:
            told, named = (" and ".join(names) or "no robot" for names in (planned.robots, robots))
            raise Refused(f"the plan has {told} do {planned}, which names {named}")
