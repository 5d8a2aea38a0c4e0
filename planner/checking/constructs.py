"""What the constructs of a program come to at a moment of the checker's replay: branches, turns, bodies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from kb.terms import Struct, Term, Var
from planner.checking.demands import Definitions, Demands
from planner.checking.knowledge import Knowledge
from planner.checking.moment import Binding, CannotCheck, Moment, bound
from planner.checking.remainder import DONE, Limited, Node, Ranked, Row, Running, Scope, Side, Todo, side

Choices = Mapping[str, Sequence[str | int]]
"""What a plan answers to each choice, by its id, in order of being asked."""


class Constructs:
    """Reads terms along the choices of a plan."""

    def __init__(
        self,
        *,
        definitions: Definitions,
        demands: Demands,
        knowledge: Knowledge,
        choices: Choices,
        excluded: frozenset[tuple[str, str | int]],
        began_ms: int,
    ) -> None:
        """Take what does not change.

        Args:
            excluded: Choices, by id, and individuals, or numbers of branches, that may not be chosen there any more.
            began_ms: When the request began, from which deadlines count.
        """
        self._definitions = definitions
        self._demands = demands
        self._knowledge = knowledge
        self._choices = choices
        self._excluded = excluded
        self._began_ms = began_ms
        self._empty: dict[int, tuple[Term, bool]] = {}
        self.reasons: list[str] = []
        """Why the plan's choices lead nowhere; cleared by who asks."""

    # From terms to nodes

    def node(self, term: Term, binding: Binding) -> Node:
        """A program that is reached now."""
        match term:
            case list(parts):
                return self.row(DONE, tuple([Todo(part, binding) for part in parts]))
            case Struct("conc", (list(parts),)):
                return side([self.node(part, binding) for part in parts], self.restless)
            case Struct("pconc", (list(parts),)):
                return Ranked(tuple([self.node(part, binding) for part in parts]))
            case Struct("search", (body,)) | Struct("picked", (_, _, body)):
                return self.node(body, binding)
            case Struct("deadline", (int(limit_ms), body)):
                return Limited(self._began_ms + limit_ms, self.node(body, binding))
            case Struct("any_order", (_, _, [], *_)):
                return DONE
            case Struct("running", (str(step_id),)):
                return Running(step_id)
            case Struct("scope", (str(process_id), head, body)):
                name, arguments = _name_and_arguments(bound(head, binding))
                return Scope(process_id, name, arguments, self.node(body, binding))
            case _:
                return Todo(term, binding)

    def row(self, first: Node, rest: tuple[Todo, ...]) -> Node:
        """One after the other, as flat as can be: the turns of a loop do not nest."""
        while first is DONE and rest:
            first, rest = self.node(rest[0].term, rest[0].binding), rest[1:]
        return Row(first, rest) if rest else first

    def body(self, process_id: str, name: str, arguments: tuple[Term, ...]) -> Node:
        """The body of a composite process that begins."""
        parameters, body = self._definition(name)
        binding: dict[str, Term] = {"Frame": process_id}
        binding.update({p.name: a for p, a in zip(parameters, arguments, strict=True) if isinstance(p, Var)})
        return self.node(body, binding)

    def opened(self, todo: Todo, moment: Moment) -> Node | None:
        """The body of a composite process that has not begun; None for any other program."""
        match todo.term:
            case Struct("call", (frame, step, head)):
                name, arguments = self.called(head, todo.binding, moment)
                if self._demands.of(name).one_step:
                    return None
                return self.body(f"{bound(frame, todo.binding)}/{step}", name, arguments)
            case _:
                return None

    # What may end by itself

    def restless(self, node: Node) -> bool:
        """Whether it, or a process in it, may end without a step of its own ending: as a condition comes to hold."""
        match node:
            case Todo(Struct("call" | "choice" | "pick" | "star" | "any_order"), _):
                return self.passable(node)
            case Todo() | Running():
                return False
            case Row(first, _):
                return self.restless(first)
            case Side():
                return bool(node.restless)
            case Ranked(parts):
                return any(self.restless(part) for part in parts)
            case Scope(_, _, _, body) | Limited(_, body):
                return self.restless(body) or self.passable(body)

    def passable(self, node: Node) -> bool:
        """Whether it may end, for all that is known of it at any time, without a step of its own ending."""
        match node:
            case Todo(term, _):
                return self._may_be_empty(term)
            case Running():
                return False
            case Row(first, rest):
                return self.passable(first) and all(self._may_be_empty(todo.term) for todo in rest)
            case Side(parts):
                return all(self.passable(part) for part in parts.values())
            case Ranked(ranked):
                return all(self.passable(part) for part in ranked)
            case Scope(_, _, _, body) | Limited(_, body):
                return self.passable(body)

    def _may_be_empty(self, term: Term) -> bool:
        """Whether a program may have nothing to do."""
        if id(term) not in self._empty:
            self._empty[id(term)] = (term, self._is_empty(term))
        return self._empty[id(term)][1]

    def _is_empty(self, term: Term) -> bool:
        match term:
            case list(parts) | Struct("conc" | "pconc", (list(parts),)):
                return all(self._may_be_empty(part) for part in parts)
            case Struct("any_order"):
                return all(self._may_be_empty(part) for part in numbered(term).values())
            case Struct("call", (_, _, Struct(name) | str(name))):
                return not self._demands.of(name).one_step and self._may_be_empty(self._definition(name)[1])
            case Struct("choice", (_, _, list(branches))):
                return any(self._may_be_empty(branch) for branch in branches)
            case Struct("if", (_, then, otherwise)):
                return self._may_be_empty(then) or self._may_be_empty(otherwise)
            case Struct("pick" | "picked" | "scope" | "deadline" | "search", (*_, part)) | Struct("until", (part, _)):
                return self._may_be_empty(part)
            case Struct("running"):
                return False
            case _:
                return True

    def _definition(self, name: str) -> tuple[tuple[Term, ...], Term]:
        if name not in self._definitions:
            raise CannotCheck(f"the program has no procedure {name}")
        return self._definitions[name]

    # What is called, chosen, repeated

    def called(self, head: Term, binding: Binding, moment: Moment) -> tuple[str, tuple[Term, ...]]:
        """The process and its arguments; the value of a fluent is looked up where it is an individual."""
        name, arguments = _name_and_arguments(bound(head, binding))
        return name, tuple([self._looked_up(argument, moment) for argument in arguments])

    def _looked_up(self, argument: Term, moment: Moment) -> Term:
        match argument:
            case Struct("fluent", (str(prop), str(subject))):
                values = self._knowledge.values(prop, subject, moment)
                return next((v for v in values if isinstance(v, str | bool)), argument)
            case _:
                return argument

    def branch(self, todo: Todo, moment: Moment) -> Node:
        """The branch of an `if`.

        Raises:
            OnlyActingTells: Which one it is.
        """
        condition, then, otherwise = _arguments(todo)
        holds = self._knowledge.holds(condition, todo.binding, moment)
        return self.node(then if holds else otherwise, todo.binding)

    def chosen(self, todo: Todo, moment: Moment, *, free: bool) -> Iterator[tuple[Node, Moment]]:
        """What a choice or pick comes to."""
        match todo.term:
            case Struct("choice", (frame, step, list(branches))):
                choice_id = f"{bound(frame, todo.binding)}/{step}"
                open_ones = [n for n in range(1, len(branches) + 1) if (choice_id, n) not in self._excluded]
                for number, after in self._answers(choice_id, open_ones, moment, free=free):
                    yield self.node(branches[int(number) - 1], todo.binding), after
            case Struct("pick", (frame, step, Var(name), str(kind), body)):
                choice_id = f"{bound(frame, todo.binding)}/{step}"
                allowed = [x for x in self._knowledge.members(kind) if (choice_id, x) not in self._excluded]
                for individual, after in self._answers(choice_id, allowed, moment, free=free):
                    yield self.node(body, {**todo.binding, name: individual}), after
            case _:
                raise CannotCheck(f"no program: {todo.term}")

    def next_parts(self, todo: Todo, moment: Moment, *, free: bool) -> Iterator[tuple[Node, Todo, Moment]]:
        """The next turn of a star, or part of an any-order, and what is left."""
        binding = todo.binding
        match todo.term:
            case Struct("star", (frame, step, body, *begun)):
                turns = int(str(begun[0])) if begun else 0
                choice_id = f"{bound(frame, binding)}/{step}/{turns}"
                rest = Todo(Struct("star", (frame, step, body, turns + 1)), binding)
                if free or self._next_answer(choice_id, moment) == "again":
                    for _, after in self._answers(choice_id, ("again",), moment, free=free):
                        yield self.node(body, binding), rest, after
            case Struct("any_order", (_, _, [], *_)):
                return
            case Struct("any_order", (frame, step, list(parts), *_)):
                left_parts = numbered(todo.term)
                choice_id = f"{bound(frame, binding)}/{step}/{len(parts)}"
                for number, after in self._answers(choice_id, list(left_parts), moment, free=free):
                    left: list[Term] = [Struct("-", (n, p)) for n, p in left_parts.items() if n != number]
                    rest = Todo(Struct("any_order", (frame, step, left, len(left))), binding)
                    yield self.node(left_parts[int(number)], binding), rest, after
            case _:
                raise CannotCheck(f"no program: {todo.term}")

    def enough(self, todo: Todo, moment: Moment, *, free: bool) -> Moment | None:
        """The moment after a star is over; None if it goes on."""
        frame, step, _, *begun = _arguments(todo)
        choice_id = f"{bound(frame, todo.binding)}/{step}/{begun[0] if begun else 0}"
        match None if free else self._next_answer(choice_id, moment):
            case None:
                return moment
            case "again":
                return None
            case _:
                return next((after for _, after in self._answers(choice_id, ("enough",), moment, free=False)), None)

    def _next_answer(self, choice_id: str, moment: Moment) -> str | int | None:
        answers, used = self._choices.get(choice_id, ()), moment.taken.get(choice_id, 0)
        return answers[used] if used < len(answers) else None

    def _answers(
        self, choice_id: str, options: Sequence[str | int], moment: Moment, *, free: bool
    ) -> Iterator[tuple[str | int, Moment]]:
        """What the plan answers to a choice; all that could be answered if that is free."""
        if free:
            for option in options:
                yield option, moment
            return
        answer = self._next_answer(choice_id, moment)
        if answer is None:
            self.reasons.append(f"the plan does not choose at {choice_id}")
        elif answer not in options or isinstance(answer, bool):
            self.reasons.append(f"at {choice_id} the plan chooses {answer}, which is none of {_some(options)}")
        else:
            yield answer, replace(moment, taken={**moment.taken, choice_id: moment.taken.get(choice_id, 0) + 1})

    def triggered(self, todo: Todo, moment: Moment) -> Node | None:
        """The turn that an interrupt takes now: for the first individuals, by name, of which its condition holds.

        Raises:
            OnlyActingTells: Whether it does.
        """
        _, _, variables, condition, body = _arguments(todo)
        over = _variables(variables)
        found = self._knowledge.solutions(over, condition, todo.binding, moment)
        if not found:
            return None
        return self.node(body, {**todo.binding, **{name: x for (name, _), x in zip(over, found[0], strict=True)}})

    def turns(self, todo: Todo, moment: Moment) -> Node:
        """The turns of a for-each, each called by its first individual where that tells it from the others.

        Raises:
            OnlyActingTells: Which turns there are.
        """
        frame, step, variables, condition, inner, body = _arguments(todo)
        assert isinstance(inner, Var)
        over, each = _variables(variables), f"{bound(frame, todo.binding)}/{step}"
        found = self._knowledge.solutions(over, condition, todo.binding, moment)
        turns_of = Counter(individuals[0] for individuals in found)
        parts = []
        for individuals in found:
            turn = individuals[0] if turns_of[individuals[0]] == 1 else "+".join(individuals)
            values = {name: x for (name, _), x in zip(over, individuals, strict=True)}
            parts.append(self.node(body, {**todo.binding, **values, inner.name: f"{each}/{turn}"}))
        return side(parts, self.restless)


def numbered(term: Struct) -> dict[int, Term]:
    """The parts of an any-order that have not begun, by their number in the written list."""
    match term.args:
        case (_, _, list(parts)):
            return dict(enumerate(parts, 1))
        case (_, _, list(parts), _):
            return {int(str(p.args[0])): p.args[1] for p in parts if isinstance(p, Struct)}
        case _:
            raise CannotCheck(f"no program: {term}")


def _arguments(todo: Todo) -> tuple[Term, ...]:
    assert isinstance(todo.term, Struct)
    return todo.term.args


def _variables(variables: Term) -> list[tuple[str, str]]:
    """Names and classes of what `[Variable-Class, ...]` lists."""
    assert isinstance(variables, list)
    pairs = [v.args for v in variables if isinstance(v, Struct)]
    return [(name.name, str(kind)) for name, kind in pairs if isinstance(name, Var)]


def _name_and_arguments(head: Term) -> tuple[str, tuple[Term, ...]]:
    match head:
        case Struct(name, arguments):
            return name, arguments
        case _:
            return str(head), ()


def _some(options: Sequence[str | int]) -> str:
    return ", ".join(map(str, options[:10])) + (", ..." if len(options) > 10 else "")
