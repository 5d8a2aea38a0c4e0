"""Every construct of programs, with an example and what other Golog interpreters have of it.

The table in docs/reference/golog.md is made of this list; tests/planner/test_constructs.py has each example planned.

In the workshop of the examples, anna and bert are robots, cup and jug are things; the cup is dirty. To wipe (`Wipe`)
takes 30 s and makes clean, to polish (`Polish`) takes 50 s, needs an arm, which bert has, and what is clean; to count
(`Count`) takes 10 s and no robot; to carry (`Carry`) takes two robots 40 s; to look (`Look`) takes 5 s and finds out
`seen`; `Tidy` wipes, then counts. The columns of other interpreters are after their source code: IndiGolog
`ai-krml-uoft/indigolog` (2025), MIndiGolog `rfk/pgrad` (2011), golog++ `MASKOR/gologpp` (2023) with
`MASKOR/readylog` (2020).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from kb.terms import Term, Var, render, struct


@dataclass(frozen=True, slots=True, kw_only=True)
class Construct:
    """A construct of programs.

    Attributes:
        term: How it is written.
        owl: The class in the ontology; empty if nobody writes it.
        meaning: What it does.
        cited: Where it is defined.
        example: A program that has it; None for what comes about at run time only.
        makespan_s: Of the plan for the example; None if there is provably none.
        starts: The steps of that plan, as (start in seconds, id, robots), in order.
        indigolog: What IndiGolog has of it.
        mindigolog: What MIndiGolog has of it.
        gologpp: What golog++ has of it.
    """

    term: str
    owl: str
    meaning: str
    cited: str
    example: Term | None = None
    makespan_s: float | None = None
    starts: tuple[tuple[float, str, str], ...] = ()
    indigolog: str = "none seen"
    mindigolog: str = "none seen"
    gologpp: str = "none seen"

    @property
    def name(self) -> str:
        """What it is called: the functor of its term, or `sequence`."""
        found = re.match(r"\w+", self.term)
        return found.group() if found else "sequence"

    @property
    def text(self) -> str:
        """The example as Prolog writes it."""
        return "" if self.example is None else re.sub(r"'-'\((\w+),('\w+')\)|-\((\w+),('\w+')\)", _pair, _text(self))


def _text(construct: Construct) -> str:
    return render(construct.example) if construct.example is not None else ""


def _pair(found: re.Match[str]) -> str:
    left, right, other_left, other_right = found.groups()
    return f"{left or other_left}-{right or other_right}"


_F = Var("F")


def _call(step: str, name: str, *arguments: Term) -> Term:
    return struct("call", _F, step, struct(name, *arguments) if arguments else name)


def _dirty(thing: Term) -> Term:
    return struct("holds", "dirty", thing, True)


_CUP = _call("cup", "Wipe", "anna", "cup")
_JUG = _call("jug", "Wipe", "anna", "jug")
_COUNT = _call("count", "Count")
_POLISH = _call("polish", "Polish", "bert", "cup")
_SEEN = struct("loc", _F, "seen")
_LOOK = _call("look", "Look", "anna", _SEEN)

CONSTRUCTS = (
    Construct(
        term="[P, ...]",
        owl="Sequence",
        meaning="one after the other; `[]` is nothing to do. `Split` is a sequence too, see below",
        cited="[ConGolog] 3",
        example=[_CUP, _POLISH],
        makespan_s=80,
        starts=((0, "cup", "anna"), (30, "polish", "bert")),
        indigolog="yes",
        mindigolog="yes",
        gologpp="yes",
    ),
    Construct(
        term="call(Frame, Step, Head)",
        owl="Perform",
        meaning="a process: a primitive action, a composite process, or a task type (`SimpleProcess`)",
        cited="[ConGolog] 4; durative and by several agents [MIndiGolog] 4",
        example=[_call("carry", "Carry", "anna", "bert"), _call("tidy", "Tidy", "anna", "cup")],
        makespan_s=80,
        starts=((0, "carry", "anna+bert"), (40, "tidy/wipe", "anna"), (70, "tidy/count", "")),
        indigolog="yes; no durations",
        mindigolog="yes; begin and natural end, one agent",
        gologpp="yes; durations `[min, max]`",
    ),
    Construct(
        term="conc([P, ...])",
        owl="SplitJoin",
        meaning="side by side, truly at the same time; ends when all have ended",
        cited="[ConGolog] 4, [MIndiGolog] 4.3",
        example=struct("conc", [_CUP, _COUNT, _call("jug", "Wipe", "bert", "jug")]),
        makespan_s=30,
        starts=((0, "cup", "anna"), (0, "count", ""), (0, "jug", "bert")),
        indigolog="`conc`, interleaved",
        mindigolog="`conc`, interleaved and true",
        gologpp="`concurrent`",
    ),
    Construct(
        term="pconc([P, ...])",
        owl="Prioritized",
        meaning="side by side; a part makes a step only if none before it can",
        cited="[ConGolog] 4",
        example=struct("pconc", [_JUG, [_CUP, _COUNT]]),
        makespan_s=70,
        starts=((0, "jug", "anna"), (30, "cup", "anna"), (60, "count", "")),
        indigolog="`pconc`",
        mindigolog="`pconc`",
    ),
    Construct(
        term="any_order(Frame, Step, [P, ...])",
        owl="AnyOrder",
        meaning="all, not overlapping, in an order that the planner chooses",
        cited="OWL-S Any-Order",
        indigolog="no; from `conc`",
        mindigolog="no",
        gologpp="no",
        example=struct("any_order", _F, "order", [_POLISH, _CUP]),
        makespan_s=80,
        starts=((0, "cup", "anna"), (30, "polish", "bert")),
    ),
    Construct(
        term="choice(Frame, Step, [P, ...])",
        owl="Choice",
        meaning="one of the programs: the planner chooses",
        cited="[Golog]",
        example=struct("choice", _F, "which", [_CUP, _COUNT]),
        makespan_s=10,
        starts=((0, "count", ""),),
        indigolog="`ndet`, `wndet`, `rndet`",
        mindigolog="`choice`",
        gologpp="`choose`",
    ),
    Construct(
        term="pick(Frame, Step, V, Class, P)",
        owl="Pick",
        meaning="`P` with an individual of the class for `V`: the planner chooses (pi)",
        cited="[Golog]",
        example=[_CUP, struct("pick", _F, "who", Var("R"), "Robot", _call("polish", "Polish", Var("R"), "cup"))],
        makespan_s=80,
        starts=((0, "cup", "anna"), (30, "polish", "bert")),
        indigolog="yes, typed by a domain",
        mindigolog="yes, untyped",
        gologpp="`pick`",
    ),
    Construct(
        term="foreach(Frame, Step, [V-Class, ...], C, Inner, P)",
        owl="ForEach",
        meaning="`P`, side by side for all combinations of individuals of which `C` holds; `Inner`: frame of a turn",
        cited="OWL-S, as `conc`",
        example=struct(
            "foreach",
            _F,
            "each",
            [struct("-", Var("X"), "Thing")],
            _dirty(Var("X")),
            Var("I"),
            struct("call", Var("I"), "wipe", struct("Wipe", "anna", Var("X"))),
        ),
        makespan_s=30,
        starts=((0, "each/cup/wipe", "anna"),),
    ),
    Construct(
        term="star(Frame, Step, P)",
        owl="Iterate",
        meaning="`P` any number of times, none included: the planner chooses",
        cited="[Golog]",
        example=[struct("star", _F, "again", _CUP), _POLISH],
        makespan_s=80,
        starts=((0, "cup", "anna"), (30, "polish", "bert")),
        indigolog="yes",
        mindigolog="yes",
        gologpp="no",
    ),
    Construct(
        term="if(C, P, Q)",
        owl="IfThenElse",
        meaning="`P` where `C` holds, else `Q`",
        cited="[ConGolog] 3",
        example=[_CUP, struct("if", _dirty("cup"), _COUNT, _POLISH)],
        makespan_s=80,
        starts=((0, "cup", "anna"), (30, "polish", "bert")),
        indigolog="yes",
        mindigolog="yes",
        gologpp="yes",
    ),
    Construct(
        term="while(C, P)",
        owl="RepeatWhile",
        meaning="`P` as long as `C` holds",
        cited="[ConGolog] 3",
        example=struct("while", _dirty("cup"), _CUP),
        makespan_s=30,
        starts=((0, "cup", "anna"),),
        indigolog="yes",
        mindigolog="yes",
        gologpp="yes",
    ),
    Construct(
        term="until(P, C)",
        owl="RepeatUntil",
        meaning="`P`, again until `C` holds; what only acting finds out ends the plan there",
        cited="OWL-S Repeat-Until",
        example=struct("until", _LOOK, struct("is_true", _SEEN)),
        makespan_s=5,
        starts=((0, "look", "anna"),),
    ),
    Construct(
        term="test(C)",
        owl="Await",
        meaning="goes on when `C` holds, in no time",
        cited="[IndiGolog]",
        example=struct("conc", [_CUP, [struct("test", struct("not", _dirty("cup"))), _COUNT]]),
        makespan_s=40,
        starts=((0, "cup", "anna"), (30, "count", "")),
        indigolog="yes",
        mindigolog="yes",
        gologpp="yes",
    ),
    Construct(
        term="interrupt(Frame, Step, [V-Class, ...], C, P)",
        owl="Interrupt",
        meaning="whenever `C` holds, for the first by name, `P`; ends with what it interrupts, not within `P`",
        cited="[ConGolog] 4.4",
        example=struct(
            "pconc",
            [
                struct(
                    "interrupt",
                    _F,
                    "dirt",
                    [struct("-", Var("X"), "Thing")],
                    _dirty(Var("X")),
                    _call("wipe", "Wipe", "anna", Var("X")),
                ),
                _JUG,
            ],
        ),
        makespan_s=60,
        starts=((0, "wipe", "anna"), (30, "jug", "anna")),
        indigolog="`interrupt`",
        mindigolog="no",
        gologpp="in ReadyLog only",
    ),
    Construct(
        term="search(P)",
        owl="Lookahead",
        meaning="`P` is planned to its end before its first step",
        cited="[IndiGolog]",
        example=struct("search", [struct("choice", _F, "which", [_COUNT, _CUP]), _POLISH]),
        makespan_s=80,
        starts=((0, "cup", "anna"), (30, "polish", "bert")),
        indigolog="`search`, `searchc`",
        mindigolog="in version 1",
        gologpp="`search`, `solve`",
    ),
    Construct(
        term="deadline(Milliseconds, P)",
        owl="Deadline",
        meaning="`P` ends so long after the request began at most",
        cited="none: a constraint on the time of [MIndiGolog] situations",
        example=struct("deadline", 20_000, struct("choice", _F, "which", [_CUP, _COUNT])),
        makespan_s=10,
        starts=((0, "count", ""),),
        gologpp="constraints on a plan once found",
    ),
    Construct(
        term="running(Id)",
        owl="",
        meaning="what remains of a primitive action that has started",
        cited="[MIndiGolog] 4.2",
    ),
    Construct(
        term="scope(Id, Head, P)",
        owl="",
        meaning="what remains of a composite process that has begun; its effects hold at its end",
        cited="[ConGolog] 4, procedures",
    ),
    Construct(
        term="picked(Id-X, Pick, P)",
        owl="",
        meaning="what remains of a pick; `Pick` is the pick as it was, for when `X` fails",
        cited="[Golog]",
    ),
)


def table() -> str:
    """The table of constructs, and that of their examples."""
    lines = [
        "| term | class in the ontology | meaning | after | [IndiGolog] | [MIndiGolog] | golog++ |",
        "|---|---|---|---|---|---|---|",
    ]
    for c in CONSTRUCTS:
        others = (
            (c.indigolog or "no", c.mindigolog or "no", c.gologpp or "no") if c.example is not None else ("", "", "")
        )
        owl = f"`{c.owl}`" if c.owl else "none"
        lines.append(f"| `{c.term}` | {owl} | {c.meaning} | {c.cited} | {' | '.join(others)} |")
    lines += ["", "| | example | makespan | its plan |", "|---|---|---|---|"]
    for c in CONSTRUCTS:
        if c.example is not None:
            lines.append(f"| {c.name} | `{c.text}` | {c.makespan_s:g} s | {', '.join(map(_start, c.starts))} |")
    return "\n".join(lines) + "\n"


def _start(start: tuple[float, str, str]) -> str:
    at_s, step, robots = start
    return f"{at_s:g} s {step}{f' ({robots})' if robots else ''}"
