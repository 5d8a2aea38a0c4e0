"""A yard of robots and processes for tests of the checker, written down in a few lines.

What a yard says stands in an `Ontology` in the way in which the knowledge base puts what it reads from files.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from kb.compiler import Program
from kb.ontology import Value
from kb.processes import Parameter, Process, Role
from kb.recursion import called
from kb.store import Snapshot
from kb.terms import Action, Argument, Data, Fluent, Struct, Term, Var, struct
from planner.plan import Plan, PlannedStep, PlanStatus
from planner.validate import Start, beginning, violations

TIMES = {
    (robot, origin, goal): float(
        abs(("here", "a", "b", "c").index(origin) - ("here", "a", "b", "c").index(goal)) + pace
    )
    for robot, pace in (("ann", 1), ("bob", 1), ("cat", 2))
    for origin in ("here", "a", "b", "c")
    for goal in ("a", "b", "c")
}
"""Places lie in a row, a second apart; setting out takes one more, cat two."""


@dataclass(slots=True)
class Yard:
    """Collects what an ontology would say."""

    base: Snapshot
    kinds: dict[str, frozenset[str]] = field(default_factory=dict)
    values: dict[tuple[str, str], tuple[Value, ...]] = field(default_factory=dict)
    processes: dict[str, Process] = field(default_factory=dict)
    definitions: list[Term] = field(default_factory=list)
    _facts: list[tuple[str, tuple[Term, ...]]] = field(default_factory=list)

    def add(self, name: str, *kinds: str, **values: Value) -> None:
        """An individual."""
        self.kinds[name] = frozenset(kinds)
        self._facts += [("kind", (name, kind)) for kind in kinds]
        self._facts += [("value", (prop, name, value)) for prop, value in values.items()]
        for prop, value in values.items():
            self.values[prop, name] = (value,)

    def process(
        self,
        name: str,
        *parameters: str,
        duration_s: float | None = None,
        to: str = "",
        effects: Sequence[tuple[str, str, Value]] = (),
        needs: Sequence[Term] = (),
        claims: Sequence[str] = (),
        odds: float | None = None,
        requires: str = "",
        keeps: bool = False,
        body: Term | None = None,
    ) -> None:
        """A process: parameters that begin with `robot` are robots; it travels if it has a place `to`.

        Args:
            effects: (property, subject parameter, value or parameter).
            needs: Preconditions; parameters are variables by their names.
        """
        roles = [Role.ROBOT if p.startswith("robot") else Role.INPUT for p in parameters]
        self.processes[name] = Process(
            name=name,
            is_atomic=body is None,
            parameters=tuple(
                Parameter(
                    entity=f"{name}_{p}",
                    name=p,
                    role=r,
                    kind="Robot" if r is Role.ROBOT else "Location" if p == "place" else "Thing",
                    is_datum=False,
                    is_place=p == "place",
                )
                for p, r in zip(parameters, roles, strict=True)
            ),
        )
        for p in parameters:
            self.values["parameterName", f"{name}_{p}"] = (p,)
        if duration_s is not None:
            self.values["duration_s", name] = (duration_s,)
        if to:
            self.add(f"{name}_model", travelingRobot=f"{name}_{parameters[0]}", travelGoal=f"{name}_{to}")
            self.values["hasDurationModel", name] = (f"{name}_model",)
        if odds is not None:
            self.values["successOdds", name] = (odds,)
        if requires:
            self.values["requiresCapability", name] = (requires,)
        if keeps:
            self.values["keepsRobot", name] = (True,)
        self.values["claimsParameter", name] = tuple(f"{name}_{p}" for p in claims)
        self.values["hasPrecondition", name] = tuple(self._condition(name, need) for need in needs)
        for prop, subject, value in effects:
            effect = f"{name}_{prop}_{subject}"
            self.add(effect, ofProperty=prop, subjectParameter=f"{name}_{subject}")
            known = "objectParameter" if value in parameters else "hasValue"
            self.values[known, effect] = (f"{name}_{value}" if value in parameters else value,)
            self.values["hasEffect", name] = (*self.values.get(("hasEffect", name), ()), effect)
        variables = tuple(Var(p.capitalize()) for p in parameters)
        head = Struct(name, variables) if variables else name
        if body is not None:
            self.definitions.append(struct("proc", head, body))
            self._facts.append(("definition", (head, Var("Frame"), body)))
            self._facts += [("recursive", (name,))] if name in called(body) else []
        once_ms = round((duration_s or 0.0) * 1000)
        once: Term = struct("travel", variables[0], Var(to.capitalize()), once_ms) if to else struct("fixed", once_ms)
        self._facts += [("duration", (head, once))] if body is None or to else []
        self._facts += [("agent", (head, v)) for v, r in zip(variables, roles, strict=True) if r is Role.ROBOT]
        self._facts += [("requires", (name, requires))] if requires else []
        self._facts += [("odds", (name, odds))] if odds is not None else []
        self._facts += [("keeps_robot", (name,))] if keeps else []
        self._facts += [("claims", (head, Var(p.capitalize()))) for p in claims]
        self._facts += [("precondition", (head, _capital(need))) for need in needs]
        self._facts += [
            (
                "effect",
                (head, struct("fluent", prop, Var(s.capitalize())), Var(str(v).capitalize()) if v in parameters else v),
            )
            for prop, s, v in effects
        ]

    def learned(self, process: str, robot: str, place: str, *, duration_s: float, odds: float) -> None:
        """What was learned of a robot at a place, or everywhere if that is empty."""
        values: dict[str, Value] = {"learnedDuration_s": duration_s, "learnedOdds": odds}
        values |= {"ofProcess": process, "ofRobot": robot} | ({"atPlace": place} if place else {})
        self.add(f"{process}_by_{robot}_{place}", "LearnedValue", **values)
        where = struct("at", place) if place else "anywhere"
        self._facts.append(("learned", (process, robot, where, round(duration_s * 1000), odds)))
        parameters = tuple(Var(p.name.capitalize()) for p in self.processes[process].parameters)
        names = ("takes_place", (Struct(process, parameters), Var("Place")))
        if Var("Place") in parameters and names not in self._facts:
            self._facts.append(names)

    def _condition(self, process: str, term: Term) -> str:
        """A condition as individuals of the ontology; returns the name of the outermost."""
        name = f"{process}_condition_{len(self.kinds)}"
        match term:
            case Struct("all" | "any" as word, (list(parts),)):
                self.add(name, "AllOf" if word == "all" else "AnyOf")
                self.values["operand", name] = tuple(self._condition(process, part) for part in parts)
            case Struct("not", (part,)):
                self.add(name, "Not")
                self.values["operand", name] = (self._condition(process, part),)
            case Struct("holds", (str(prop), Var(subject), value)):
                self.add(name, "Holds", ofProperty=prop, subjectParameter=f"{process}_{subject}")
                self._right(process, name, value)
            case Struct("compare", (str(comparison), Struct("value", (str(prop), Var(subject))), right)):
                told = comparison.replace("_", " ")
                self.add(name, "Compare", ofProperty=prop, subjectParameter=f"{process}_{subject}", comparison=told)
                if isinstance(right, Struct):
                    self.values["objectProperty", name] = (str(right.args[0]),)
                    right = right.args[1]
                self._right(process, name, right)
            case _:
                raise ValueError(f"no condition: {term}")
        return name

    def _right(self, process: str, name: str, value: Term) -> None:
        match value:
            case Var(parameter):
                self.values["objectParameter", name] = (f"{process}_{parameter}",)
            case str() | int() | float():
                self.values["hasValue", name] = (value,)
            case _:
                raise ValueError(f"no value: {value}")

    def facts(self, revision: int) -> list[Term]:
        """The same for the planner: facts of kb/rules/facts.pl."""
        return [Struct(functor, (revision, *arguments)) for functor, arguments in self._facts]

    def snapshot(self) -> Snapshot:
        """What the yard says."""
        ontology = replace(self.base.ontology, kinds=self.kinds, _values=self.values)
        return replace(self.base, ontology=ontology, processes=self.processes, fluents={})

    def program(self, name: str = "Main") -> Program:
        """The program of the request."""
        return Program(name=name, definitions=tuple(self.definitions))


def _capital(term: Term) -> Term:
    """Variables by the names that they have in the head of the process."""
    match term:
        case Var(name):
            return Var(name.capitalize())
        case Struct(functor, arguments):
            return Struct(functor, tuple(map(_capital, arguments)))
        case list():
            return list(map(_capital, term))
        case _:
            return term


@dataclass(slots=True)
class Timetable:
    """Puts a plan together, step by step."""

    yard: Yard
    made_at_s: float = 0.0
    steps: list[PlannedStep] = field(default_factory=list)

    def step(self, step_id: str, head: str, start_s: float, end_s: float) -> Timetable:
        """One more step: `Carry(ann,b)` from `start_s` to `end_s`; its id goes on after `task/task/`."""
        name, _, rest = head.rstrip(")").partition("(")
        self.steps.append(
            PlannedStep(
                action=self.action(f"task/task/{step_id}", name, rest.split(",") if rest else []),
                start_s=start_s,
                end_s=end_s,
            )
        )
        return self

    def action(self, step_id: str, name: str, values: Sequence[str | Data | Fluent]) -> Action:
        """An action of a process of the yard."""
        parameters = self.yard.processes[name].arguments
        arguments = tuple(
            Argument(name=p.name, role=p.role.value, value=v) for p, v in zip(parameters, values, strict=True)
        )
        robots = tuple(str(a.value) for a in arguments if a.role == "robot")
        return Action(id=step_id, process=name, robots=robots, arguments=arguments)

    def plan(
        self, choices: Mapping[str, str | int | tuple[str | int, ...]] = {}, *, waits_for: tuple[str, ...] = ()
    ) -> Plan:
        """The plan; its choices by what follows `task/task/` in their ids."""
        end_s = max((s.end_s for s in self.steps), default=self.made_at_s)
        return Plan(
            status=PlanStatus.SOLVED_OPTIMALLY,
            made_at_s=self.made_at_s,
            makespan_s=end_s - self.made_at_s,
            lower_bound_s=end_s - self.made_at_s,
            steps=tuple(sorted(self.steps, key=lambda s: (s.start_s, s.action.robot or "", s.end_s))),
            choices={
                f"task/task/{at}": chosen if isinstance(chosen, tuple) else (chosen,) for at, chosen in choices.items()
            },
            nodes=0,
            reason="",
            waits_for=waits_for,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A request in a yard, for which there are plans."""

    yard: Yard
    robots: int = 3
    times: Mapping[tuple[str, str, str], float] = field(default_factory=lambda: TIMES)

    def violations(self, plan: Plan, start: Start | None = None) -> list[str]:
        """What the checker says of a plan."""
        return violations(
            plan,
            self.yard.snapshot(),
            self.yard.program(),
            beginning("task", "Main", plan.made_at_s) if start is None else start,
            robots=self.robots,
            travel_times=self.times,
        )


def yard(base: Snapshot) -> Yard:
    """Robots ann, bob and cat, of whom ann and bob can lift; places a, b, c; a door; boxes; and what can be done."""
    made = Yard(base)
    made.add("ann", "Robot", "Lifter")
    made.add("bob", "Robot", "Lifter")
    made.add("cat", "Robot")
    for place in ("a", "b", "c"):
        made.add(place, "Place")
    made.add("door", "Door")
    made.add("lot", "Lot", capacity=2)
    made.add("red", "Box", heavy=True, stands="a", weight=5)
    made.add("blue", "Box", heavy=True, stands="b", weight=3.5)
    made.add("gray", "Box", heavy=False, stands="c", weight=1)
    made.process("Go", "robot", "place", to="place", duration_s=0.5, effects=[("locatedAt", "robot", "place")])
    made.definitions.append(struct("proc", struct("Go", Var("Robot"), Var("Place")), []))
    made.process("Work", "robot", duration_s=2.0)
    made.process("Rest", "robot", duration_s=0.0)
    made.process("Think", duration_s=1.0)
    made.process("Lift", "robot", "box", duration_s=1.0, requires="Lifter", effects=[("lifted", "box", True)])
    made.process(
        "Drop",
        "robot",
        "box",
        duration_s=1.0,
        needs=[struct("holds", "lifted", Var("box"), True)],
        effects=[("lifted", "box", False)],
    )
    made.process("Carry", "robot1", "robot2", "place", to="place", duration_s=1.0, requires="Lifter",
                 effects=[("locatedAt", "robot1", "place"), ("locatedAt", "robot2", "place")])  # fmt: skip
    made.definitions.append(struct("proc", struct("Carry", Var("Robot1"), Var("Robot2"), Var("Place")), []))
    made.process("Pass", "robot", "door", duration_s=1.5, claims=["door"])
    made.process("Try", "robot", duration_s=1.0, odds=0.8)
    made.process("Seek", "robot", "place", to="place", duration_s=0.5, odds=0.7)
    made.definitions.append(struct("proc", struct("Seek", Var("Robot"), Var("Place")), []))
    return made


def call(step: str, name: str, *arguments: Term, frame: Term = Var("Frame")) -> Term:  # noqa: B008
    """A call in the body of the process at hand."""
    return struct("call", frame, step, Struct(name, arguments) if arguments else name)
