"""The independent checker: per construct, the plans that it accepts and those that it refuses, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from kb.store import Snapshot
from kb.terms import Term, Var, struct
from planner.plan import Plan, PlannedStep, PlanStatus
from planner.validate import CannotCheck, Start
from tests.planner.yard import Job, Timetable, Yard, call, yard

FRAME = Var("Frame")
HEAVY = struct("holds", "heavy", Var("Box"), True)


def lifted(box: str, value: bool = True) -> Term:
    """The condition that a box is lifted."""
    return struct("holds", "lifted", box, value)


def lift(step: str, robot: Term, box: Term) -> Term:
    """A call of Lift."""
    return call(step, "Lift", robot, box)


class Case:
    """A request, and the timetables that are put to it."""

    def __init__(self, base: Snapshot, body: Term, *, robots: int = 3, prepare: Callable[[Yard], None] | None = None):
        made = yard(base)
        if prepare is not None:
            prepare(made)
        made.process("Main", body=body)
        self.job = Job(yard=made, robots=robots)

    def at(self, made_at_s: float = 0.0) -> Timetable:
        """An empty timetable."""
        return Timetable(self.job.yard, made_at_s)

    def accepts(self, plan: Plan) -> None:
        """The checker finds nothing wrong."""
        assert self.job.violations(plan) == []

    def refuses(self, plan: Plan, why: str) -> None:
        """The checker finds what is wrong, and says so in one sentence of which `why` is part."""
        found = self.job.violations(plan)
        assert any(why in violation for violation in found), found


# ---------------------------------------------------------------------------- order and concurrency


def test_a_sequence(tue_lab: Snapshot) -> None:
    """One after the other, each step as long as it takes."""
    case = Case(tue_lab, [call("x", "Work", "ann"), call("y", "Think"), call("z", "Work", "ann")])
    good = case.at().step("x", "Work(ann)", 0, 2).step("y", "Think", 2, 3).step("z", "Work(ann)", 3, 5)
    case.accepts(good.plan())
    case.accepts(
        case.at(7).step("x", "Work(ann)", 7, 9).step("y", "Think", 9, 10).step("z", "Work(ann)", 11, 13).plan()
    )
    case.refuses(case.at().step("x", "Work(ann)", 0, 2).step("y", "Think", 1.9, 2.9).plan(), "wants task/task/x to end")
    case.refuses(case.at().step("x", "Work(ann)", 0, 2).step("y", "Think", 2, 3).plan(), "the plan lacks Work")
    case.refuses(case.at().step("y", "Think", 2, 3).plan(), "before, it wants Work (task/task/x)")
    case.refuses(case.at().step("x", "Work(bob)", 0, 2).plan(), "where the program asks for Work(ann)")
    case.refuses(case.at().step("x", "Work(ann)", 0, 2.5).plan(), "takes 2.000 s, not 2.500 s")
    case.refuses(good.step("elsewhere", "Think", 5, 6).plan(), "does not ask for Think")


def test_side_by_side(tue_lab: Snapshot) -> None:
    """Robots work at once; each does one thing at a time."""
    case = Case(tue_lab, struct("conc", [call("x", "Work", "ann"), call("y", "Work", "ann"), call("z", "Work", "bob")]))
    case.accepts(
        case.at().step("x", "Work(ann)", 2, 4).step("y", "Work(ann)", 0, 2).step("z", "Work(bob)", 0.5, 2.5).plan()
    )
    at_once = case.at().step("x", "Work(ann)", 0, 2).step("y", "Work(ann)", 1.999, 3.999).step("z", "Work(bob)", 0, 2)
    case.refuses(at_once.plan(), "at once")
    case.refuses(case.at().step("x", "Work(ann)", 0, 2).step("z", "Work(bob)", 0, 2).plan(), "the plan lacks Work")
    twice = case.at().step("x", "Work(ann)", 0, 2).step("x", "Work(ann)", 2, 4).step("y", "Work(ann)", 4, 6)
    case.refuses(twice.step("z", "Work(bob)", 0, 2).plan(), "does not ask for Work(ann) (task/task/x)")


def test_what_is_split_off_is_waited_for_by_nobody_but_the_end(tue_lab: Snapshot) -> None:
    """A split compiles to a concurrency with what follows it; the process ends when all has ended."""
    body = struct("conc", [call("x", "Work", "ann"), [call("y", "Think"), call("z", "Think")]])
    case = Case(tue_lab, body)
    good = case.at().step("y", "Think", 0, 1).step("z", "Think", 1, 2)
    case.refuses(good.plan(), "the plan lacks Work")
    case.accepts(good.step("x", "Work(ann)", 0, 2).plan())


def test_any_order(tue_lab: Snapshot) -> None:
    """All parts, none begun before the one before is over, in the order that the plan chooses."""
    parts: list[Term] = [[call("x", "Work", "ann"), call("y", "Think")], call("z", "Work", "bob")]
    case = Case(tue_lab, struct("any_order", FRAME, "o", parts))
    later = case.at().step("z", "Work(bob)", 0, 2).step("x", "Work(ann)", 2, 4).step("y", "Think", 4, 5)
    case.accepts(later.plan({"o/2": 2, "o/1": 1}))
    case.accepts(
        case.at()
        .step("x", "Work(ann)", 0, 2)
        .step("y", "Think", 2, 3)
        .step("z", "Work(bob)", 3, 5)
        .plan({"o/2": 1, "o/1": 2})
    )
    case.refuses(later.plan({"o/2": 1, "o/1": 2}), "does not ask for Work(bob)")
    case.refuses(later.plan({"o/2": 2}), "does not choose at task/task/o/1")
    case.refuses(later.plan({"o/2": 2, "o/1": 2}), "which is none of 1")
    between = case.at().step("x", "Work(ann)", 0, 2).step("z", "Work(bob)", 2, 4).step("y", "Think", 4, 5)
    case.refuses(between.plan({"o/2": 1, "o/1": 2}), "before, it wants Think")


def test_choice(tue_lab: Snapshot) -> None:
    """The branch that the plan chooses, and no other."""
    case = Case(tue_lab, struct("choice", FRAME, "c", [call("x", "Work", "ann"), call("y", "Think"), []]))
    thinking = case.at().step("y", "Think", 0, 1)
    case.accepts(thinking.plan({"c": 2}))
    case.accepts(case.at().plan({"c": 3}))
    case.refuses(thinking.plan({"c": 1}), "does not ask for Think")
    case.refuses(thinking.plan({"c": 4}), "the plan chooses 4, which is none of 1, 2, 3")
    case.refuses(thinking.plan({"c": "red"}), "the plan chooses red")
    case.refuses(thinking.plan(), "the plan does not choose at task/task/c")
    case.refuses(thinking.plan({"c": (2, 1)}), "does not ask for what the plan chooses at task/task/c")
    case.refuses(case.at().plan({"c": 1}), "the plan lacks")


def test_pick(tue_lab: Snapshot) -> None:
    """The individual that the plan chooses, of the class asked for, which can do it."""
    case = Case(tue_lab, struct("pick", FRAME, "p", Var("R"), "Robot", lift("x", Var("R"), "red")))
    case.accepts(case.at().step("x", "Lift(bob,red)", 0, 1).plan({"p": "bob"}))
    case.refuses(case.at().step("x", "Lift(bob,red)", 0, 1).plan({"p": "ann"}), "asks for Lift(ann, red)")
    case.refuses(case.at().step("x", "Lift(cat,red)", 0, 1).plan({"p": "cat"}), "cat does Lift but is no Lifter")
    case.refuses(
        case.at().step("x", "Lift(red,red)", 0, 1).plan({"p": "red"}), "the plan chooses red, which is none of"
    )
    start = Start(
        remaining=struct("call", "task", "task", "Main"), began_s=0.0, excluded=frozenset({("task/task/p", "bob")})
    )
    found = case.job.violations(case.at().step("x", "Lift(bob,red)", 0, 1).plan({"p": "bob"}), start)
    assert "the plan chooses bob" in found[0]


def test_task_type(tue_lab: Snapshot) -> None:
    """A task type is a choice among its recipes; a robot needs what all of them need."""

    def prepare(made: Yard) -> None:
        made.process("ByHand", "robot", body=[lift("x", Var("Robot"), "red")])
        made.process("Slowly", "robot", body=[call("y", "Work", Var("Robot"))])
        recipes: list[Term] = [call("ByHand", "ByHand", Var("Robot")), call("Slowly", "Slowly", Var("Robot"))]
        made.process("Clear", "robot", body=struct("choice", FRAME, "recipe", recipes))

    case = Case(tue_lab, call("t", "Clear", "cat"), prepare=prepare)
    case.accepts(case.at().step("t/Slowly/y", "Work(cat)", 0, 2).plan({"t/recipe": 2}))
    case.refuses(case.at().step("t/ByHand/x", "Lift(cat,red)", 0, 1).plan({"t/recipe": 1}), "but is no Lifter")


# ------------------------------------------------------------------------------- conditions and loops


def test_if_is_decided_when_its_first_step_starts(tue_lab: Snapshot) -> None:
    """The branch depends on what effects have set by then, not on what was so in the beginning."""
    branch = struct("if", lifted("red"), call("x", "Work", "bob"), call("y", "Think"))
    case = Case(tue_lab, struct("conc", [lift("l", "ann", "red"), branch]))
    case.accepts(case.at().step("l", "Lift(ann,red)", 0, 1).step("x", "Work(bob)", 1, 3).plan())
    case.accepts(case.at().step("l", "Lift(ann,red)", 0, 1).step("y", "Think", 0.999, 1.999).plan())
    case.refuses(case.at().step("l", "Lift(ann,red)", 0, 1).step("x", "Work(bob)", 0.999, 2.999).plan(), "not ask for")
    case.refuses(case.at().step("l", "Lift(ann,red)", 0, 1).step("y", "Think", 1, 2).plan(), "not ask for Think")
    case.refuses(case.at().step("l", "Lift(ann,red)", 0, 1).plan(), "what depends on lifted(red) = True")


def test_while_turns_as_long_as_its_condition_holds(tue_lab: Snapshot) -> None:
    """It is asked before each turn; the same steps come again under the same ids."""

    def prepare(made: Yard) -> None:
        made.process("Eat", "robot", "box", "left", duration_s=1.0, effects=[("rest", "box", "left")])
        made.add("pie", "Box", rest="two")

    turn = struct("choice", FRAME, "c", [call("e", "Eat", "ann", "pie", "one"), call("f", "Eat", "ann", "pie", "none")])
    hungry = struct("not", struct("holds", "rest", "pie", "none"))
    case = Case(tue_lab, [struct("while", hungry, turn), call("z", "Think")], prepare=prepare)
    good = case.at().step("e", "Eat(ann,pie,one)", 0, 1).step("f", "Eat(ann,pie,none)", 1, 2)
    case.accepts(replace_steps(good, 2, "z", 3).plan({"c": (1, 2)}))
    long = case.at().step("e", "Eat(ann,pie,one)", 0, 1).step("e", "Eat(ann,pie,one)", 1, 2)
    long.step("f", "Eat(ann,pie,none)", 2, 3).step("z", "Think", 3, 4)
    case.accepts(long.plan({"c": (1, 1, 2)}))
    case.refuses(long.plan({"c": (1, 2, 2)}), "does not ask for Eat")
    case.refuses(long.plan({"c": (1, 1, 2, 1)}), "does not ask for what the plan chooses")
    early = case.at().step("e", "Eat(ann,pie,one)", 0, 1).step("z", "Think", 1, 2)
    case.refuses(early.plan({"c": 1}), "the plan does not choose at task/task/c")
    late = case.at().step("f", "Eat(ann,pie,none)", 0, 1).step("e", "Eat(ann,pie,one)", 1, 2).step("z", "Think", 2, 3)
    case.refuses(late.plan({"c": (2, 1)}), "does not ask for Eat(ann,")


def replace_steps(timetable: Timetable, start_s: float, step: str, end_s: float) -> Timetable:
    """The timetable with a Think at the end."""
    return timetable.step(step, "Think", start_s, end_s)


def test_until_has_a_turn_and_more_until_its_condition_holds(tue_lab: Snapshot) -> None:
    """The body first, then the test."""
    turn = struct("choice", FRAME, "c", [lift("x", "ann", "red"), call("y", "Think")])
    case = Case(tue_lab, [struct("until", turn, lifted("red")), call("z", "Think")])
    good = case.at().step("y", "Think", 0, 1).step("x", "Lift(ann,red)", 1, 2).step("z", "Think", 2, 3)
    case.accepts(good.plan({"c": (2, 1)}))
    case.refuses(case.at().step("y", "Think", 0, 1).step("z", "Think", 1, 2).plan({"c": 2}), "does not choose at")
    case.refuses(case.at().step("z", "Think", 0, 1).plan(), "does not choose")
    over = case.at().step("x", "Lift(ann,red)", 0, 1).step("y", "Think", 1, 2).step("z", "Think", 2, 3)
    case.refuses(over.plan({"c": (1, 2)}), "does not ask for Think")


def test_star_turns_as_often_as_the_plan_says(tue_lab: Snapshot) -> None:
    """Again and again, until it is enough."""
    case = Case(tue_lab, [struct("star", FRAME, "s", call("x", "Work", "ann")), call("z", "Think")])
    twice = case.at().step("x", "Work(ann)", 0, 2).step("x", "Work(ann)", 2, 4).step("z", "Think", 4, 5)
    case.accepts(twice.plan({"s/0": "again", "s/1": "again", "s/2": "enough"}))
    case.accepts(twice.plan({"s/0": "again", "s/1": "again"}))
    case.accepts(case.at().step("z", "Think", 0, 1).plan({"s/0": "enough"}))
    case.refuses(twice.plan({"s/0": "again", "s/1": "enough"}), "does not ask for Work(ann)")
    case.refuses(case.at().step("z", "Think", 0, 1).plan({"s/0": "again"}), "does not ask for Think")
    case.refuses(twice.plan({"s/0": "again", "s/1": "again", "s/2": "perhaps"}), "chooses perhaps")


def test_await_goes_on_when_its_condition_holds(tue_lab: Snapshot) -> None:
    """What follows starts once the condition holds, and while it does."""
    body = struct("conc", [[lift("l", "ann", "red"), call("d", "Drop", "ann", "red")],
                           [struct("test", lifted("red")), call("x", "Work", "bob")]])  # fmt: skip
    case = Case(tue_lab, body)
    carried = case.at().step("l", "Lift(ann,red)", 0, 1).step("d", "Drop(ann,red)", 1, 2)
    case.accepts(replaced(case, carried).step("x", "Work(bob)", 1, 3).plan())
    case.accepts(replaced(case, carried).step("x", "Work(bob)", 1.999, 3.999).plan())
    for start_s in (0.999, 2.0):
        case.refuses(replaced(case, carried).step("x", "Work(bob)", start_s, start_s + 2).plan(), "to be settled")


def replaced(case: Case, timetable: Timetable) -> Timetable:
    """A timetable with the same steps."""
    return Timetable(case.job.yard, timetable.made_at_s, list(timetable.steps))


def test_conditions(tue_lab: Snapshot) -> None:
    """All words of conditions, with values of every sort."""

    def compared(word: str, left: Term, right: Term) -> Term:
        return struct("compare", word, left, right)

    red, blue = struct("value", "weight", "red"), struct("value", "weight", "blue")
    true = [
        compared("less", blue, red),
        compared("at_most", 5, red),
        compared("more", red, 4.5),
        compared("at_least", red, blue),
        compared("equal", red, 5.0),
        struct("any", [lifted("red"), struct("holds", "stands", "red", "a")]),
        struct("all", [struct("holds", "heavy", "gray", False), struct("not", lifted("red"))]),
        struct("all", []),
    ]
    false = [
        compared("less", red, blue),
        compared("more", red, struct("value", "stands", "red")),
        compared("at_most", struct("value", "weight", "ann"), 7),
        struct("holds", "heavy", "red", 1),
        struct("holds", "weight", "red", 5.0),
        struct("any", []),
    ]
    for condition, holds in [(c, True) for c in true] + [(c, False) for c in false]:
        case = Case(tue_lab, struct("if", condition, call("x", "Think"), call("y", "Think")))
        taken, other = ("x", "y") if holds else ("y", "x")
        case.accepts(case.at().step(taken, "Think", 0, 1).plan())
        case.refuses(case.at().step(other, "Think", 0, 1).plan(), "does not ask for Think")


def each(*variables: tuple[str, str], where: Term, do: Term) -> Term:
    """A for-each."""
    over: list[Term] = [struct("-", Var(name), kind) for name, kind in variables]
    return struct("foreach", FRAME, "each", over, where, Var("Inner"), do)


def test_for_each_has_a_turn_for_all_of_which_its_condition_holds_when_it_begins(tue_lab: Snapshot) -> None:
    """Turns are side by side; effects before it count, those of its own turns do not."""
    turn = call("x", "Work", "ann", frame=Var("Inner"))
    case = Case(tue_lab, [lift("l", "ann", "gray"), each(("Box", "Box"), where=lifted_box(), do=turn)])
    case.accepts(case.at().step("l", "Lift(ann,gray)", 0, 1).step("each/gray/x", "Work(ann)", 1, 3).plan())
    case.refuses(case.at().step("each/gray/x", "Work(ann)", 0, 2).plan(), "before, it wants Lift")
    case.refuses(case.at().step("l", "Lift(ann,gray)", 0, 1).plan(), "the plan lacks what task/task/each asks for")
    stray = case.at().step("l", "Lift(ann,gray)", 0, 1).step("each/red/x", "Work(ann)", 1, 3)
    case.refuses(stray.plan(), "does not ask for Work")

    both = each(("Box", "Box"), ("Place", "Place"), where=struct("all", [
        struct("holds", "stands", Var("Box"), Var("Place")), HEAVY]), do=struct("pick", Var("Inner"), "p", Var("R"),
        "Robot", call("go", "Go", Var("R"), Var("Place"), frame=Var("Inner"))))  # fmt: skip
    case = Case(tue_lab, both)
    good = case.at().step("each/red/go", "Go(ann,a)", 0, 2.5).step("each/blue/go", "Go(bob,b)", 0, 3.5)
    case.accepts(good.plan({"each/red/p": "ann", "each/blue/p": "bob"}))
    case.refuses(good.plan({"each/red/p": "bob", "each/blue/p": "ann"}), "asks for Go(bob, a)")
    alone = case.at().step("each/red/go", "Go(ann,a)", 0, 2.5)
    case.refuses(alone.plan({"each/red/p": "ann"}), "the plan does not choose at task/task/each/blue/p")


def lifted_box() -> Term:
    """The condition that the box of a for-each is lifted."""
    return struct("holds", "lifted", Var("Box"), True)


def test_turns_of_one_first_individual_are_called_by_all(tue_lab: Snapshot) -> None:
    """Where the first individual does not tell turns apart, all together do."""
    turn = call("x", "Think", frame=Var("Inner"))
    where = struct("any", [struct("holds", "stands", Var("Box"), Var("Place")),
                           struct("all", [struct("holds", "weight", Var("Box"), 5), struct("not", struct(
                               "holds", "stands", Var("Box"), Var("Place")))])])  # fmt: skip
    case = Case(tue_lab, each(("Box", "Box"), ("Place", "Place"), where=where, do=turn))
    good = case.at()
    for name in ("red+a", "red+b", "red+c", "blue", "gray"):
        good.step(f"each/{name}/x", "Think", 0, 1)
    case.accepts(good.plan())


# -------------------------------------------------------------- priority, interrupts, search, deadlines


def test_priority(tue_lab: Snapshot) -> None:
    """A part begins something only while those before it can begin nothing."""
    case = Case(
        tue_lab, struct("pconc", [call("x", "Work", "ann"), call("y", "Work", "bob"), call("z", "Work", "ann")])
    )
    good = case.at().step("x", "Work(ann)", 0, 2).step("y", "Work(bob)", 0, 2).step("z", "Work(ann)", 2, 4)
    case.accepts(good.plan())
    case.accepts(
        case.at().step("x", "Work(ann)", 1, 3).step("y", "Work(bob)", 1, 3).step("z", "Work(ann)", 3, 5).plan()
    )
    case.refuses(
        case.at().step("x", "Work(ann)", 0.5, 2.5).step("y", "Work(bob)", 0, 2).step("z", "Work(ann)", 3, 5).plan(),
        "something of higher priority could begin instead",
    )
    case.refuses(
        case.at().step("x", "Work(ann)", 2, 4).step("y", "Work(bob)", 2, 4).step("z", "Work(ann)", 0, 2).plan(),
        "something of higher priority",
    )


def test_an_interrupt_takes_the_first_for_which_its_condition_holds(tue_lab: Snapshot) -> None:
    """Whenever it holds, and again; it may end between its turns."""
    drop = call("d", "Drop", "bob", Var("Box"))
    watch = struct("interrupt", FRAME, "i", [struct("-", Var("Box"), "Box")], lifted_box(), drop)
    lifts = [lift("l", "ann", "red"), lift("m", "ann", "gray"), call("t", "Think")]
    case = Case(tue_lab, struct("pconc", [watch, lifts]))
    ups = case.at().step("l", "Lift(ann,red)", 0, 1)
    good = replaced(case, ups).step("d", "Drop(bob,red)", 1, 2).step("m", "Lift(ann,gray)", 1, 2)
    good.step("t", "Think", 2, 3).step("d", "Drop(bob,gray)", 2, 3)
    case.accepts(good.plan())
    undone = replaced(case, ups).step("d", "Drop(bob,red)", 1, 2).step("m", "Lift(ann,gray)", 1, 2)
    case.refuses(replaced(case, undone).step("t", "Think", 2, 3).plan(), "something of higher priority")
    wrong = replaced(case, ups).step("d", "Drop(bob,gray)", 1, 2)
    case.refuses(wrong.plan(), "where the program asks for Drop(bob, red)")
    early = case.at().step("d", "Drop(bob,red)", 0, 1)
    case.refuses(early.plan(), "does not ask for Drop")


def test_search_is_transparent_and_a_deadline_is_kept(tue_lab: Snapshot) -> None:
    """A deadline counts from the beginning of the request, not of what it is about."""
    case = Case(tue_lab, [call("a", "Think"), struct("search", struct("deadline", 4000, call("x", "Work", "ann")))])
    case.accepts(case.at().step("a", "Think", 0, 1).step("x", "Work(ann)", 2, 4).plan())
    case.refuses(case.at().step("a", "Think", 0, 1).step("x", "Work(ann)", 2.001, 4.001).plan(), "after its deadline 4")
    start = Start(remaining=struct("call", "task", "task", "Main"), began_s=-2.0)
    late = case.at().step("a", "Think", 0, 1).step("x", "Work(ann)", 1, 3).plan()
    assert "after its deadline 2" in case.job.violations(late, start)[0]

    waiting = struct("deadline", 2000, [call("x", "Think"), struct("test", lifted("red"))])
    case = Case(tue_lab, struct("conc", [[waiting, call("z", "Think")], lift("l", "ann", "red")]))
    thought = case.at().step("x", "Think", 0, 1)
    case.accepts(replaced(case, thought).step("l", "Lift(ann,red)", 1, 2).step("z", "Think", 5, 6).plan())
    case.refuses(
        replaced(case, thought).step("l", "Lift(ann,red)", 1.5, 2.5).step("z", "Think", 5, 6).plan(),
        "late for its deadline 2",
    )


# --------------------------------------------------------------------------- what processes ask for


def test_a_precondition_holds_at_the_start(tue_lab: Snapshot) -> None:
    """Of a step, and of a composite process at its first step."""

    def prepare(made: Yard) -> None:
        light = struct("compare", "at_most", struct("value", "weight", Var("box")), 4)
        made.process("Pack", "robot", "box", needs=[light], body=[call("w", "Work", Var("Robot"))])
        made.process("Weigh", "robot", "box", duration_s=1.0, effects=[("weight", "box", 4)])

    body = [call("v", "Weigh", "ann", "red"), call("p", "Pack", "ann", "red")]
    case = Case(tue_lab, struct("conc", body), prepare=prepare)
    case.accepts(case.at().step("v", "Weigh(ann,red)", 0, 1).step("p/w", "Work(ann)", 1, 3).plan())
    case.refuses(
        case.at().step("p/w", "Work(ann)", 0, 2).step("v", "Weigh(ann,red)", 2, 3).plan(),
        "without weight(red) at most 4, which Pack needs",
    )
    case = Case(tue_lab, [lift("l", "ann", "red"), call("d", "Drop", "ann", "blue")])
    case.refuses(
        case.at().step("l", "Lift(ann,red)", 0, 1).step("d", "Drop(ann,blue)", 1, 2).plan(),
        "without lifted(blue) = True, which Drop needs",
    )


def test_the_effects_of_a_process_hold_when_it_has_ended(tue_lab: Snapshot) -> None:
    """As soon as its body is done, even where that is because of a condition."""

    def prepare(made: Yard) -> None:
        steps: Term = [
            call("w", "Work", Var("Robot")),
            struct("while", struct("not", lifted("red")), call("t", "Think")),
        ]
        made.process("Watch", "robot", effects=[("watched", "robot", True)], body=steps)

    after = [struct("test", struct("holds", "watched", "bob", True)), call("z", "Think")]
    body = struct("conc", [call("k", "Watch", "bob"), after, lift("l", "ann", "red")])
    case = Case(tue_lab, body, prepare=prepare)
    good = case.at().step("k/w", "Work(bob)", 0, 2).step("l", "Lift(ann,red)", 3, 4)
    case.accepts(replaced(case, good).step("z", "Think", 4, 5).plan())
    case.refuses(replaced(case, good).step("z", "Think", 3.999, 4.999).plan(), "to be settled")
    case.refuses(replaced(case, good).step("k/t", "Think", 4, 5).step("z", "Think", 5, 6).plan(), "not ask for Think")


def test_a_process_with_nothing_to_do_ends_at_once(tue_lab: Snapshot) -> None:
    """And has its effects."""

    def prepare(made: Yard) -> None:
        made.process("Note", "robot", effects=[("noted", "robot", True)], body=[])

    body = struct("conc", [call("n", "Note", "ann"), [struct("test", struct("holds", "noted", "ann", True)),
                                                      call("z", "Think")]])  # fmt: skip
    case = Case(tue_lab, body, prepare=prepare)
    case = Case(tue_lab, struct("conc", [body, call("t", "Think")]), prepare=prepare)
    case.accepts(case.at().step("t", "Think", 0, 1).step("z", "Think", 0, 1).plan())
    case.refuses(case.at().step("t", "Think", 0, 1).plan(), "the plan lacks Think (task/task/z)")


def test_travel_starts_from_where_the_robot_is(tue_lab: Snapshot) -> None:
    """From here at first, then from where it has been sent."""
    case = Case(tue_lab, [call("x", "Go", "ann", "c"), call("y", "Go", "ann", "b"), call("z", "Go", "ann", "b")])
    good = case.at().step("x", "Go(ann,c)", 0, 4.5).step("y", "Go(ann,b)", 4.5, 7)
    case.accepts(replaced(case, good).step("z", "Go(ann,b)", 7, 8.5).plan())
    case.refuses(replaced(case, good).step("z", "Go(ann,b)", 7, 9.5).plan(), "takes 1.500 s, not 2.500 s")
    case = Case(tue_lab, call("x", "Go", "ann", "door"))
    case.refuses(case.at().step("x", "Go(ann,door)", 0, 4.5).plan(), "ann has no way from here to door")


def test_two_robots_do_one_step_together(tue_lab: Snapshot) -> None:
    """Both are there for all of it, the first one travels, and both are at its goal afterwards."""
    case = Case(tue_lab, [struct("conc", [call("g", "Go", "bob", "a"), call("w", "Work", "ann")]),
                          call("x", "Carry", "ann", "bob", "b"), call("y", "Go", "bob", "c")])  # fmt: skip
    good = case.at().step("g", "Go(bob,a)", 0, 2.5).step("w", "Work(ann)", 0, 2)
    case.accepts(replaced(case, good).step("x", "Carry(ann,bob,b)", 2.5, 6.5).step("y", "Go(bob,c)", 6.5, 9).plan())
    from_elsewhere = replaced(case, good).step("x", "Carry(ann,bob,b)", 2.5, 5.5).step("y", "Go(bob,c)", 5.5, 8)
    case.refuses(from_elsewhere.plan(), "takes 4.000 s, not 3.000 s")
    case.refuses(replaced(case, good).step("x", "Carry(bob,ann,b)", 2.5, 5.5).plan(), "asks for Carry(ann, bob, b)")

    body = struct("conc", [call("x", "Carry", "ann", "bob", "b"), call("w", "Work", "bob")])
    case = Case(tue_lab, body)
    case.accepts(case.at().step("x", "Carry(ann,bob,b)", 2, 6).step("w", "Work(bob)", 0, 2).plan())
    case.refuses(case.at().step("x", "Carry(ann,bob,b)", 0, 4).step("w", "Work(bob)", 3.5, 5.5).plan(), "at once")
    one = Case(tue_lab, struct("pick", FRAME, "p", Var("R"), "Robot", call("x", "Carry", Var("R"), "bob", "b")))
    one.refuses(one.at().step("x", "Carry(bob,bob,b)", 0, 4).plan({"p": "bob"}), "bob is but one")
    one.refuses(one.at().step("x", "Carry(cat,bob,b)", 0, 5).plan({"p": "cat"}), "cat does Carry but is no Lifter")
    good_plan = one.at().step("x", "Carry(ann,bob,b)", 0, 4).plan({"p": "ann"})
    one.accepts(good_plan)
    half = replace(good_plan.steps[0].action, robots=("ann",))
    one.refuses(replace(good_plan, steps=(replace(good_plan.steps[0], action=half),)), "which names ann and bob")


def test_a_process_that_keeps_its_robot(tue_lab: Snapshot) -> None:
    """From its first step to its end, even between its steps."""

    def prepare(made: Yard) -> None:
        made.process("Job", "robot", keeps=True, body=[call("a", "Work", Var("Robot")), call("b", "Think"),
                                                       call("c", "Work", Var("Robot"))])  # fmt: skip

    case = Case(tue_lab, struct("conc", [call("j", "Job", "ann"), call("r", "Try", "ann")]), prepare=prepare)
    kept = case.at().step("j/a", "Work(ann)", 0, 2).step("j/b", "Think", 2, 3)
    case.accepts(replaced(case, kept).step("j/c", "Work(ann)", 4, 6).step("r", "Try(ann)", 6, 7.25).plan())
    between = replaced(case, kept).step("r", "Try(ann)", 2, 3.25).step("j/c", "Work(ann)", 4, 6)
    case.refuses(between.plan(), "comes between the steps of task/task/j, which keeps its robot ann")


def test_a_claim_is_exclusive_as_far_as_the_capacity_goes(tue_lab: Snapshot) -> None:
    """A door lets one through at a time, a lot two; a process may use what it has claimed itself."""
    through = struct("conc", [call("x", "Pass", "ann", "door"), call("y", "Pass", "bob", "door")])
    case = Case(tue_lab, through)
    case.accepts(case.at().step("x", "Pass(ann,door)", 0, 1.5).step("y", "Pass(bob,door)", 1.5, 3).plan())
    case.refuses(
        case.at().step("x", "Pass(ann,door)", 0, 1.5).step("y", "Pass(bob,door)", 1.499, 2.999).plan(),
        "uses door while",
    )
    parts: list[Term] = [call(step, "Pass", robot, "lot") for step, robot in (("x", "ann"), ("y", "bob"), ("z", "cat"))]
    case = Case(tue_lab, struct("conc", parts))
    two = case.at().step("x", "Pass(ann,lot)", 0, 1.5).step("y", "Pass(bob,lot)", 1, 2.5)
    case.accepts(replaced(case, two).step("z", "Pass(cat,lot)", 1.5, 3).plan())
    case.refuses(replaced(case, two).step("z", "Pass(cat,lot)", 1.4, 2.9).plan(), "uses lot while")

    def prepare(made: Yard) -> None:
        steps: list[Term] = [call("a", "Pass", Var("Robot"), Var("Door")), call("b", "Think")]
        made.process("Cross", "robot", "door", claims=["door"], body=steps)

    case = Case(tue_lab, struct("conc", [call("c", "Cross", "ann", "door"), call("y", "Pass", "bob", "door")]),
                prepare=prepare)  # fmt: skip
    cross = case.at().step("c/a", "Pass(ann,door)", 0, 1.5).step("c/b", "Think", 1.5, 2.5)
    case.accepts(replaced(case, cross).step("y", "Pass(bob,door)", 2.5, 4).plan())
    case.refuses(replaced(case, cross).step("y", "Pass(bob,door)", 1.5, 3).plan(), "uses door while task/task/c does")


def test_odds_lengthen_what_a_step_is_expected_to_take(tue_lab: Snapshot) -> None:
    """Travel and the rest are divided by the odds and rounded each, half to even."""
    case = Case(tue_lab, [call("x", "Try", "ann"), call("y", "Seek", "ann", "b")])
    tried = case.at().step("x", "Try(ann)", 0, 1.25)
    case.accepts(replaced(case, tried).step("y", "Seek(ann,b)", 1.25, 1.25 + 4.286 + 0.714).plan())
    case.refuses(replaced(case, tried).step("y", "Seek(ann,b)", 1.25, 1.25 + 3 + 0.5).plan(), "takes 5.000 s")
    case.refuses(case.at().step("x", "Try(ann)", 0, 1).plan(), "takes 1.250 s, not 1.000 s")


def test_a_robot_works_no_longer_than_its_energy_lasts(tue_lab: Snapshot) -> None:
    """All its steps count, waiting does not."""

    def prepare(made: Yard) -> None:
        made.add("ann", "Robot", "Lifter", energy_J=10.0, power_W=2.5)

    case = Case(tue_lab, [call("x", "Work", "ann"), call("y", "Work", "ann")], prepare=prepare)
    good = case.at().step("x", "Work(ann)", 0, 2).step("y", "Work(ann)", 9, 11).plan()
    case.accepts(good)
    worked = Start(remaining=struct("call", "task", "task", "Main"), began_s=0.0, worked_ms={"ann": 1})
    assert "ann works 4.001 s in all; its energy lasts for 4.000 s" in case.job.violations(good, worked)[0]


def test_no_more_robots_than_may_take_part(tue_lab: Snapshot) -> None:
    """What has taken part before counts too."""
    body = struct("conc", [call("x", "Work", "ann"), call("y", "Work", "bob")])
    case = Case(tue_lab, body, robots=2)
    good = case.at().step("x", "Work(ann)", 0, 2).step("y", "Work(bob)", 2, 4).plan()
    case.accepts(good)
    other = Start(remaining=struct("call", "task", "task", "Main"), began_s=0.0, team=frozenset({"cat"}))
    assert "3 robots take part; at most 2 may" in case.job.violations(good, other)[0]
    assert "2 robots take part; at most 1 may" in replace(case.job, robots=1).violations(good)[0]


def test_the_value_of_a_fluent_is_looked_up_when_the_step_starts(tue_lab: Snapshot) -> None:
    """An argument may be the present value of a property."""
    case = Case(tue_lab, [call("g", "Go", "ann", struct("fluent", "stands", "blue"))])
    case.accepts(case.at().step("g", "Go(ann,b)", 0, 3.5).plan())
    case.refuses(case.at().step("g", "Go(ann,a)", 0, 2.5).plan(), "asks for Go(ann, b)")


# --------------------------------------------------------------------------------- instants and figures


def test_what_ends_at_an_instant_has_ended_for_what_starts_then(tue_lab: Snapshot) -> None:
    """Steps that take no time come in some order."""
    body = struct(
        "conc",
        [call("x", "Work", "ann"), call("y", "Rest", "ann"), [call("z", "Rest", "bob"), call("w", "Work", "bob")]],
    )
    case = Case(tue_lab, body)
    case.accepts(
        case.at()
        .step("x", "Work(ann)", 0, 2)
        .step("y", "Rest(ann)", 0, 0)
        .step("w", "Work(bob)", 1, 3)
        .step("z", "Rest(bob)", 1, 1)
        .plan()
    )
    case.refuses(
        case.at().step("x", "Work(ann)", 0, 2).step("y", "Rest(ann)", 1, 1).step("z", "Rest(bob)", 0, 0).plan(),
        "at once",
    )


def test_of_effects_that_contradict_each_other_either_may_be_the_last(tue_lab: Snapshot) -> None:
    """Where two steps that end at one instant set one fluent, a plan may rely on any order, but on one."""
    both = struct("conc", [call("d", "Drop", "ann", "red"), lift("m", "bob", "red")])
    up, down = struct("test", lifted("red")), struct("test", lifted("red", False))
    for tests, sound in (([up], True), ([down], True), ([up, down], False)):
        case = Case(tue_lab, [lift("l", "ann", "red"), both, *tests, call("z", "Think")])
        steps = (
            case.at().step("l", "Lift(ann,red)", 0, 1).step("d", "Drop(ann,red)", 1, 2).step("m", "Lift(bob,red)", 1, 2)
        )
        assert (case.job.violations(steps.step("z", "Think", 2, 3).plan()) == []) is sound


def test_the_figures_of_a_plan(tue_lab: Snapshot) -> None:
    """Makespan, bound, status and times are what they are said to be."""
    case = Case(tue_lab, [call("x", "Work", "ann")])
    plan = case.at(5).step("x", "Work(ann)", 5, 7).plan()
    case.accepts(plan)
    case.accepts(replace(plan, lower_bound_s=1.0, status=PlanStatus.SOLVED_SATISFICING))
    case.refuses(replace(plan, makespan_s=1.9, lower_bound_s=1.9), "the makespan is 2.000 s, not 1.900 s")
    case.refuses(replace(plan, lower_bound_s=2.1), "is above the makespan")
    case.refuses(replace(plan, lower_bound_s=1.9), "does not prove 2.000 s the least")
    case.refuses(replace(plan, made_at_s=5.5, makespan_s=1.5, lower_bound_s=1.5), "before the plan is made")
    case.refuses(case.at(5).step("x", "Work(ann)", 5.0004, 7.0004).plan(), "no whole number of milliseconds")
    case.refuses(case.at(5).step("x", "Work(ann)", 5, 4).plan(), "before it starts")
    for odd in (float("nan"), float("inf")):
        case.refuses(replace(plan, makespan_s=odd), "is no time")
        case.refuses(replace(plan, steps=(replace(plan.steps[0], end_s=odd),)), "no whole number of milliseconds")


def test_a_term_that_is_no_program_cannot_be_checked(tue_lab: Snapshot) -> None:
    """It says which term."""
    case = Case(tue_lab, struct("mystery", FRAME))
    with pytest.raises(CannotCheck, match="mystery"):
        case.job.violations(case.at().plan())


# ----------------------------------------------------------------------- what only acting finds out


def sensing(base: Snapshot) -> Case:
    """Looks, and goes on by what it has seen."""
    seen = struct("is_true", struct("loc", FRAME, "seen"))
    body: list[Term] = [
        struct(
            "conc", [[call("x", "Work", "ann"), struct("if", seen, call("y", "Work", "ann"), [])], call("t", "Think")]
        ),
        call("z", "Think"),
    ]
    return Case(base, body)


def test_a_plan_goes_as_far_as_can_be_told(tue_lab: Snapshot) -> None:
    """To where all waits for what only acting finds out."""
    case = sensing(tue_lab)
    so_far = case.at().step("x", "Work(ann)", 0, 2).step("t", "Think", 0, 1)
    case.accepts(so_far.plan(waits_for=("task/task/seen",)))
    case.refuses(so_far.plan(), "the plan ends to wait for nothing; the program waits for task/task/seen")
    case.refuses(so_far.plan(waits_for=("task/task/heard",)), "wait for task/task/heard")
    case.refuses(case.at().step("x", "Work(ann)", 0, 2).plan(waits_for=("task/task/seen",)), "the plan lacks")
    beyond = replaced(case, so_far).step("y", "Work(ann)", 2, 4)
    case.refuses(beyond.plan(waits_for=("task/task/seen",)), "only acting tells task/task/seen")
    known = Start(remaining=struct("call", "task", "task", "Main"), began_s=0.0, truths={"task/task/seen": True})
    full = replaced(case, beyond).step("z", "Think", 4, 5)
    assert case.job.violations(full.plan(), known) == []
    assert case.job.violations(full.plan(), replace(known, truths={"task/task/seen": False})) != []


def test_what_is_false_anyway_waits_for_nothing(tue_lab: Snapshot) -> None:
    """A part of a condition may decide it though another is not known."""
    unknown = struct("is_true", struct("loc", FRAME, "seen"))
    for word, known in (("all", lifted("red")), ("any", struct("not", lifted("red")))):
        case = Case(tue_lab, struct("if", struct(word, [unknown, known]), call("x", "Think"), call("y", "Think")))
        case.accepts(case.at().step("y" if word == "all" else "x", "Think", 0, 1).plan())


# --------------------------------------------------------------------------------- from the middle on


def test_from_the_middle_of_things(tue_lab: Snapshot) -> None:
    """A step under way goes on to its end, a process that has begun has its robot and its door."""
    case = Case(tue_lab, [], prepare=lambda made: made.process("Job", "robot", keeps=True, body=[]))
    work = case.at().action("task/task/j/a", "Pass", ["ann", "door"])
    inside: Term = [struct("running", "task/task/j/a"), struct("call", "task/task/j", "c", struct("Work", "ann"))]
    remaining = struct(
        "scope",
        "task/task",
        "Main",
        struct(
            "conc",
            [
                struct(
                    "picked",
                    struct("-", "task/task/p", "ann"),
                    [],
                    struct("scope", "task/task/j", struct("Job", "ann"), inside),
                ),
                [struct("call", "task/task", "w", struct("Work", "ann"))],
                struct("star", "task/task", "s", struct("call", "task/task", "b", struct("Pass", "bob", "door")), 2),
                struct(
                    "any_order",
                    "task/task",
                    "o",
                    [struct("-", 3, struct("call", "task/task", "q", "Think"))],
                    1,
                ),
            ],
        ),
    )
    start = Start(
        remaining=remaining,
        began_s=0.0,
        running=(PlannedStep(action=work, start_s=9.0, end_s=10.5),),
        held={"ann": "task/task/j"},
        claimed={"door": ("task/task/j/a",)},
        team=frozenset({"ann"}),
    )

    def plan(*, until: float = 10.5, door: float = 10.5, between: float = 12.5) -> Plan:
        made = case.at(10.0).step("j/a", "Pass(ann,door)", 10, until).step("j/c", "Work(ann)", 10.5, 12.5)
        made.step("w", "Work(ann)", between, between + 2).step("b", "Pass(bob,door)", door, door + 1.5)
        return made.step("q", "Think", 10, 11).plan({"s/2": "again", "s/3": "enough", "o/1": 3})

    assert case.job.violations(plan(), start) == []
    assert "is under way until 10.500 s; the plan does not say so" in case.job.violations(plan(until=11.5), start)[0]
    assert "uses door while" in case.job.violations(plan(door=10.0), start)[0]
    kept = case.job.violations(replace_step(plan(between=14.0), "j/c", 16.0), start)
    assert "comes between the steps of task/task/j" in kept[0]
    assert case.job.violations(plan(), replace(start, held={}, team=frozenset({"ann", "cat"}))) == []
    short = replace(case.job, robots=2).violations(plan(), replace(start, team=frozenset({"ann", "cat"})))
    assert "3 robots take part" in short[0]


def replace_step(plan: Plan, step: str, start_s: float) -> Plan:
    """The plan with one step at another time, and the figures that go with it."""
    steps = [
        replace(s, start_s=start_s, end_s=start_s + s.end_s - s.start_s) if s.action.id.endswith(step) else s
        for s in plan.steps
    ]
    took_s = max(s.end_s for s in steps) - plan.made_at_s
    return replace(plan, steps=tuple(steps), makespan_s=took_s, lower_bound_s=took_s)


def test_a_robot_that_does_not_answer(tue_lab: Snapshot) -> None:
    """It does nothing; where nothing is said it answers."""

    def prepare(made: Yard) -> None:
        made.add("dan", "Robot", "Lifter", isReachable=False)
        made.add("eve", "Robot", "Lifter", isReachable=True)

    for robot in ("dan", "eve", "ann"):
        case = Case(tue_lab, [call("x", "Work", robot)], prepare=prepare)
        plan = case.at().step("x", f"Work({robot})", 0, 2).plan()
        if robot == "dan":
            case.refuses(plan, "dan does Work but does not answer")
        else:
            case.accepts(plan)
