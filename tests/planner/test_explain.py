"""Explanations: what would come of other choices, what is in the way, and what would help, each against a plan."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import pytest

from kb.compiler import Compiler, Program
from kb.prolog import Entry, PrologError
from kb.store import Snapshot
from kb.terms import Term, Var, render, struct
from planner.answers import Help, Remedy, as_data
from planner.explain import Explainer, NoSuchChoice
from planner.explaining_starts import Cause
from planner.hypotheses import Change, ChangeKind
from planner.obstacles import ObstacleKind
from planner.plan import Plan, PlanStatus
from planner.planner import Session
from planner.progress import Started
from tests.planner.conftest import Times, travel_of
from tests.planner.yard import TIMES, Yard, call, yard
from tests.planner.yard_programs import random_job

FRAME, ROBOT = Var("Frame"), Var("Robot")
_REVISION = -7
_LOOPS = ("star(", "while(", "until(", "interrupt(")

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_needed_travels = Entry(search_path="planner_golog", file="planning", name="needed_travels")


class OneProgram(Compiler):
    """Knows the program of a yard."""

    def __init__(self, made: Yard) -> None:
        self._made = made

    def program(self, name: str) -> Program:
        return self._made.program(name)


@contextmanager
def asked_in(made: Yard, *, robots: int, times: Times) -> Iterator[tuple[Session, Explainer]]:
    """A session of a yard's request, and who explains it; afterwards nothing of it is left."""
    snapshot = replace(made.snapshot(), revision=_REVISION, compiler=OneProgram(made))
    _load_facts(made.facts(_REVISION))
    session = Session("task", snapshot, "Main", {}, robots=robots)
    try:
        yield session, Explainer(session, travel_of(times), now_s=0.0)
    finally:
        session.close()
        _drop_facts(_REVISION)


@contextmanager
def asked(
    base: Snapshot,
    body: Term,
    *,
    robots: int = 3,
    prepare: Callable[[Yard], None] = lambda made: None,
    times: Times = TIMES,
) -> Iterator[tuple[Session, Explainer]]:
    """The same for a request that is written in the test."""
    made = yard(base)
    weight, payload = struct("value", "weight", Var("box")), struct("value", "payload", Var("robot"))
    made.process("Haul", "robot", "box", duration_s=4.0, needs=[struct("compare", "at_least", payload, weight)])
    prepare(made)
    made.process("Main", body=body)
    with asked_in(made, robots=robots, times=times) as both:
        yield both


def planned(session: Session, times: Times = TIMES) -> Plan:
    """The plan of a session in a yard."""
    return session.plan(travel_of(times), now_s=0.0)


def pick(step: str, body: Term, kind: str = "Robot") -> Term:
    """A robot is picked for what is to be done."""
    return struct("pick", FRAME, step, ROBOT, kind, body)


def payloads(made: Yard) -> None:
    """What ann, bob and cat can carry."""
    for robot, kinds, payload in (("ann", ("Robot", "Lifter"), 4.0), ("bob", ("Robot", "Lifter"), 10.0)):
        made.add(robot, *kinds, payload=payload)
    made.add("cat", "Robot", payload=2.5)


def texts(remedies: tuple[Remedy, ...]) -> set[str]:
    """What remedies say."""
    return {r.text for r in remedies}


# ---------------------------------------------------------------------------------- why this robot


def lab_times(pace: Mapping[str, float]) -> Times:
    """Two tables, 4 s apart for a robot of pace 1, at different distances from the robots."""
    far = {("here", "at_coffee_table"): 3.0, ("here", "at_dining_table"): 5.0, ("at_coffee_table",) * 2: 0.0}
    far |= {("at_dining_table",) * 2: 0.0, ("at_coffee_table", "at_dining_table"): 4.0}
    far |= {("at_dining_table", "at_coffee_table"): 4.0}
    return {(r, a, b): s * p for r, p in pace.items() for (a, b), s in far.items()}


def test_every_alternative_has_its_best_makespan(tue_lab: Snapshot) -> None:
    """In the shipped lab, each other robot for each drink: as trying all assignments and orders says."""
    times = lab_times({"amigo_1": 1.0, "pico_1": 1.5})
    at = {"drink_1": "at_coffee_table", "drink_2": "at_dining_table"}
    search_s = 1.5 + 0.149  # Navigate's fixed time, then the other steps of SearchDrink

    def tour_s(robot: str, drinks: tuple[str, ...]) -> float:
        stops = ["here", *(at[d] for d in drinks)]
        return sum(times[robot, a, b] + search_s for a, b in itertools.pairwise(stops))

    def best_s(who: Mapping[str, str]) -> float:
        own = {r: [d for d in at if who[d] == r] for r in ("amigo_1", "pico_1")}
        return max(min((tour_s(r, o) for o in itertools.permutations(own[r])), default=0.0) for r in own)

    session = Session("explained", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    plan = session.plan(travel_of(times), now_s=0.0)
    explained = Explainer(session, travel_of(times), now_s=0.0).why(plan)
    session.close()
    seen = 0
    for reason in explained.choices:
        drink, other = reason.choice.split("/")[-2], next(d for d in at if d != reason.choice.split("/")[-2])
        for alternative in reason.alternatives:
            bests = [best_s({drink: str(alternative.label), other: r}) for r in ("amigo_1", "pico_1")]
            told = f"would take {min(bests):.3f} s instead of {plan.makespan_s:.3f} s"
            assert f"{alternative.label} {told}" in reason.text
            seen += 1
    assert seen == 2
    assert json.loads(json.dumps(as_data(explained)))["makespan_s"] == plan.makespan_s


def test_a_robot_that_cannot_carry_it_is_told_with_both_figures(tue_lab: Snapshot) -> None:
    """The payload against the weight; either would have to be another, and with it there is a plan."""
    body = pick("who", call("haul", "Haul", ROBOT, "red"))
    with asked(tue_lab, body, prepare=payloads) as (session, explainer):
        plan = planned(session)
        [reason] = explainer.why(plan).choices
        assert reason.chosen == ("bob",)
        ann, cat = reason.alternatives
        assert (ann.status, ann.makespan_s) == (PlanStatus.UNSOLVABLE_PROVEN, None)
        assert ann.obstacles[0].kind is ObstacleKind.CONDITION
        assert "ann cannot do Haul: payload(ann) is 4 and has to be at least weight(red), 5" in ann.text
        assert texts(ann.remedies) == {
            "payload(ann) were at least weight(red), 5 (now 4)",
            "weight(red) were at most payload(ann), 4 (now 5)",
        }
        assert texts(cat.remedies) == {
            "payload(cat) were at least weight(red), 5 (now 2.5)",
            "weight(red) were at most payload(cat), 2.5 (now 5)",
        }
        not_ann = explainer.why_not(plan, "task/task/who", "ann")
    assert replace(not_ann, text="") == replace(ann, text="")
    for remedy in ann.remedies:
        [change] = remedy.changes
        with asked(tue_lab, body, prepare=lambda made, c=change: with_value(made, c)) as (session, _):  # type: ignore[misc]
            assert planned(session).makespan_s == remedy.makespan_s == 4.0


def with_value(made: Yard, change: Change) -> None:
    """A yard in which a change has come true and only ann is a robot."""
    made.kinds.update(bob=frozenset({"Thing"}), cat=frozenset({"Thing"}))
    for fact in list(made._facts):
        if fact in [("kind", (robot, "Robot")) for robot in ("bob", "cat")]:
            made._facts.remove(fact)
        if fact[0] == "value" and fact[1][:2] == (change.what, change.subject):
            made._facts.remove(fact)
    values = {"ann": ("payload", 4.0), change.subject: (change.what, change.value)}
    for subject, (prop, value) in values.items():
        made.values[prop, subject] = (value,)
        made._facts.append(("value", (prop, subject, value)))


def test_a_robot_that_lacks_a_capability_is_told_so(tue_lab: Snapshot) -> None:
    """With what it would have to be; the obstacles of the whole request tell it too."""
    with asked(tue_lab, pick("who", call("lift", "Lift", ROBOT, "red"))) as (session, explainer):
        plan = planned(session)
        why_not = explainer.why_not(plan, "task/task/who", "cat")
        explained = explainer.why(plan)
        [obstacle] = explained.obstacles
    assert why_not.text == "cat is not possible: cat cannot do Lift: it is no Lifter (it would be if cat were a Lifter)"
    assert [r.makespan_s for r in why_not.remedies] == [1.0]
    assert (obstacle.kind, obstacle.robots) == (ObstacleKind.CAPABILITY, ("cat",))
    assert "\ncat cannot do Lift: it is no Lifter\nWhat decides the makespan:" in explained.text


def test_a_branch_is_called_by_its_process(tue_lab: Snapshot) -> None:
    """Of two recipes the shorter is chosen; the other would take longer."""
    body = struct("choice", FRAME, "how", [call("w", "Work", "ann"), call("t", "Think")])
    with asked(tue_lab, body) as (session, explainer):
        [reason] = explainer.why(planned(session)).choices
    assert reason.text == "Think at how: Work would take 2.000 s instead of 1.000 s"


def test_parts_in_any_order(tue_lab: Snapshot) -> None:
    """The other part first would take longer; what is left at the end is no choice."""
    body = struct("any_order", FRAME, "all", [call("x", "Go", "ann", "c"), call("y", "Go", "ann", "a")])
    with asked(tue_lab, body) as (session, explainer):
        plan = planned(session)
        first, last = explainer.why(plan).choices
        swapped = explainer.why_not(plan, "task/task/all/2", 1)
    assert (first.chosen, [a.label for a in first.alternatives]) == ((2,), [1])
    assert first.alternatives[0].makespan_s == swapped.makespan_s
    assert swapped.makespan_s is not None
    assert swapped.makespan_s > plan.makespan_s
    assert last.text.endswith("there is no other choice")


def test_a_loop_may_go_on_or_end(tue_lab: Snapshot) -> None:
    """Without a turn, what comes after it cannot be done."""
    body = struct("star", FRAME, "more", call("lift", "Lift", "ann", "red"))
    with asked(tue_lab, [body, call("drop", "Drop", "ann", "red")]) as (session, explainer):
        plan = planned(session)
        [reason] = explainer.why(plan).choices
        enough = explainer.why_not(plan, "task/task/more/0", "enough")
    assert reason.chosen == ("again",)
    assert texts(enough.remedies) == {"lifted(red) were true (not known)"}


# ------------------------------------------------------------------------------- why then, in this order


def test_each_step_tells_what_it_waits_for(tue_lab: Snapshot) -> None:
    """A busy robot, a door in use, a step that the program wants before."""
    parts: list[Term] = [
        [call("w", "Work", "ann"), call("p", "Pass", "ann", "door")],
        [call("v", "Work", "cat"), call("z", "Rest", "cat"), call("q", "Pass", "bob", "door")],
    ]
    with asked(tue_lab, struct("conc", parts)) as (session, explainer):
        plan = planned(session)
        explained = explainer.why(plan)
    starts = {s.step.rpartition("/")[2]: s for s in explained.starts}
    assert starts["w"].cause is starts["v"].cause is Cause.BEGINNING
    assert (starts["z"].cause, starts["z"].shared) == (Cause.ROBOT, ("cat",))
    late, early = ("p", "q") if starts["q"].start_s < starts["p"].start_s else ("q", "p")
    assert (starts[late].cause, starts[late].shared) == (Cause.RESOURCE, ("door",))
    assert starts[late].waits_for == (starts[early].step,)
    assert starts[late].text.endswith("door was in use by " + starts[early].action)
    assert {s.step for s in explained.critical} > {starts["p"].step, starts["q"].step}


def test_what_is_not_critical_has_time(tue_lab: Snapshot) -> None:
    """Only the longer branch, and what comes after both, decide the makespan."""
    body: Term = [struct("conc", [call("w", "Work", "ann"), call("t", "Think")]), call("u", "Pass", "bob", "door")]
    with asked(tue_lab, body) as (session, explainer):
        explained = explainer.why(planned(session))
    assert [s.step[-1] for s in explained.critical] == ["w", "u"]
    assert explained.critical[1].cause is Cause.PROGRAM
    assert explained.critical[1].waits_for == ("task/task/w",)


def test_another_order_all_else_as_planned(tue_lab: Snapshot) -> None:
    """The farther place first takes longer, as the travel times say; what no robot shares has no order."""
    parts = [call("near", "Go", "ann", "a"), call("far", "Go", "ann", "c"), call("other", "Work", "bob")]
    with asked(tue_lab, struct("conc", parts)) as (session, explainer):
        plan = planned(session)
        swapped = explainer.why_not_first(plan, "far", "near")
        same = explainer.why_not_first(plan, "near", "far")
        with pytest.raises(NoSuchChoice, match="share no robot"):
            explainer.why_not_first(plan, "other", "near")
        with pytest.raises(NoSuchChoice, match="'nowhere'"):
            explainer.why_not_first(plan, "nowhere", "near")
    assert swapped.makespan_s == TIMES["ann", "here", "c"] + TIMES["ann", "c", "a"] + 2 * 0.5
    assert plan.makespan_s == TIMES["ann", "here", "a"] + TIMES["ann", "a", "c"] + 2 * 0.5
    assert "instead of" in swapped.text
    assert same.text == "near comes before far as it is"


def test_an_order_that_the_program_forbids(tue_lab: Snapshot) -> None:
    """It comes to no end."""
    with asked(tue_lab, [call("x", "Work", "ann"), call("y", "Rest", "ann")]) as (session, explainer):
        assert explainer.why_not_first(planned(session), "y", "x").makespan_s is None


# ------------------------------------------------------------------------------------ what would help


def helped(
    base: Snapshot,
    body: Term,
    *,
    robots: int = 3,
    prepare: Callable[[Yard], None] = lambda made: None,
    times: Times = TIMES,
) -> Help:
    """What would make an impossible request possible."""
    with asked(base, body, robots=robots, prepare=prepare, times=times) as (session, explainer):
        assert planned(session, times).status is PlanStatus.UNSOLVABLE_PROVEN
        return explainer.what_would_help()


def test_more_robots(tue_lab: Snapshot) -> None:
    """No more than the plan needs."""
    steps = [call("x", "Work", "ann"), call("y", "Work", "bob")]
    found = helped(tue_lab, struct("conc", steps), robots=1)
    assert found.text == "the request would be possible if 2 robots might take part (now at most 1)"
    assert found.complete


def test_a_longer_deadline(tue_lab: Snapshot) -> None:
    """No longer than it takes."""
    found = helped(tue_lab, struct("deadline", 3500, [call("x", "Work", "ann"), call("y", "Work", "ann")]))
    assert texts(found.remedies) == {"Main had 4.000 s (now a deadline of 3.500 s)"}


def test_a_fuller_battery(tue_lab: Snapshot) -> None:
    """As much energy as the work takes, at the power that it takes; for the whole task, not for one step."""

    def prepare(made: Yard) -> None:
        made.add("ann", "Robot", energy_J=10.0, power_W=4.0)

    body = [call("x", "Work", "ann"), call("y", "Work", "ann")]
    found = helped(tue_lab, body, prepare=prepare)
    [remedy] = found.remedies
    [change] = remedy.changes
    assert (change.kind, change.subject, change.what, change.now) == (ChangeKind.VALUE, "ann", "energy_J", 10.0)
    assert isinstance(change.value, float)
    assert 16.0 <= change.value <= 16.01
    assert found.obstacles == ()

    def long(made: Yard) -> None:
        prepare(made)
        made.process("Toil", "robot", duration_s=3.0)

    found = helped(tue_lab, call("x", "Toil", "ann"), prepare=long)
    [obstacle] = found.obstacles
    assert obstacle.text == "ann cannot do Toil: it takes 3 s of work, and the battery lasts for 2.5 s"


def test_a_way(tue_lab: Snapshot) -> None:
    """As fast as another robot has it; a place that nobody reaches is reached in no time."""
    cut = {way: s for way, s in TIMES.items() if way[0] != "ann" or way[2] != "b"}
    found = helped(tue_lab, call("go", "Go", "ann", "b"), times=cut)
    assert texts(found.remedies) == {"there were a way to b for ann"}
    assert found.remedies[0].makespan_s == TIMES["bob", "here", "b"] + 0.5
    closed = {way: s for way, s in TIMES.items() if way[2] != "b"}
    assert helped(tue_lab, call("go", "Go", "ann", "b"), times=closed).remedies[0].makespan_s == 0.5


def test_two_changes_together(tue_lab: Snapshot) -> None:
    """Where no single one helps; each fact once, and nothing that is not needed."""
    body = [call("lift", "Lift", "cat", "gray"), call("haul", "Haul", "cat", "red")]
    found = helped(tue_lab, body, prepare=payloads)
    assert texts(found.remedies) == {
        "cat were a Lifter and payload(cat) were at least weight(red), 5 (now 2.5)",
        "cat were a Lifter and weight(red) were at most payload(cat), 2.5 (now 5)",
    }
    assert [r.makespan_s for r in found.remedies] == [5.0, 5.0]


def test_a_value_that_nothing_sets(tue_lab: Snapshot) -> None:
    """A truth value; and a condition over several, of which one is broken."""
    found = helped(tue_lab, call("drop", "Drop", "ann", "red"))
    assert texts(found.remedies) == {"lifted(red) were true (not known)"}

    def prepare(made: Yard) -> None:
        heavy, stands = struct("holds", "heavy", Var("box"), True), struct("holds", "stands", Var("box"), "a")
        made.process("Roll", "robot", "box", duration_s=1.0, needs=[struct("all", [struct("not", heavy), stands])])

    found = helped(tue_lab, call("roll", "Roll", "ann", "red"), prepare=prepare)
    assert texts(found.remedies) == {"heavy(red) were false (now true)"}
    assert found.remedies[0].changes[0].value is False


@pytest.mark.parametrize(
    ("relation", "bound", "value"), [("less", 5, 4), ("more", 5, 6), ("at_most", 4.5, 4.5), ("equal", 7, 7)]
)
def test_limits_of_all_sorts(tue_lab: Snapshot, relation: str, bound: float, value: float) -> None:
    """The value that would do is the nearest that is in the relation."""

    def prepare(made: Yard) -> None:
        limit = struct("compare", relation, struct("value", "weight", Var("box")), bound)
        made.process("Slide", "robot", "box", duration_s=1.0, needs=[limit])

    box = "blue" if relation == "more" else "red"
    found = helped(tue_lab, call("slide", "Slide", "ann", box), prepare=prepare)
    [change] = found.remedies[0].changes
    assert (change.subject, change.value) == (box, value)


def test_nothing_helps(tue_lab: Snapshot) -> None:
    """Where the same robot would have to be two, and where nobody is there to be chosen."""
    found = helped(tue_lab, call("carry", "Carry", "ann", "ann", "b"))
    assert (found.remedies, found.complete) == ((), True)
    assert found.obstacles[0].kind is ObstacleKind.SAME_ROBOT
    found = helped(tue_lab, pick("who", call("w", "Work", ROBOT), kind="Ghost"))
    assert [o.text for o in found.obstacles] == ["Main cannot be done: there is no Ghost"]
    assert found.text.endswith("\nno one or two changes of facts would make the request possible")


def test_a_possible_request_needs_no_help(tue_lab: Snapshot) -> None:
    """It says so, and tries nothing."""
    with asked(tue_lab, call("x", "Work", "ann")) as (_, explainer):
        assert explainer.what_would_help().text == "the request is possible as it is"


# ----------------------------------------------------------------------------- bounds, and what is left


def test_a_spent_budget_is_told(tue_lab: Snapshot) -> None:
    """What was not tried is not said to be impossible."""
    body = pick("who", call("lift", "Lift", ROBOT, "red"))
    with asked(tue_lab, body) as (session, _):
        plan = planned(session)
        none = Explainer(session, travel_of(TIMES), now_s=0.0, most_plans=0)
        one = Explainer(session, travel_of(TIMES), now_s=0.0, most_plans=1)
        assert none.why_not(plan, "task/task/who", "cat").text == "cat was not tried"
        assert none.what_would_help().status is PlanStatus.TIMEOUT
        told = one.why_not(plan, "task/task/who", "cat")
    assert told.text == "cat is not possible: cat cannot do Lift: it is no Lifter (what would help was not tried)"


def test_what_is_no_choice_is_refused(tue_lab: Snapshot) -> None:
    """A choice that the plan does not come to, a label that is none, what is chosen anyway."""
    with asked(tue_lab, pick("who", call("w", "Work", ROBOT))) as (session, explainer):
        plan = planned(session)
        [chosen] = plan.choices["task/task/who"]
        with pytest.raises(NoSuchChoice, match=r"no choice of the plan belongs to 'nothing'; there is who"):
            explainer.why_not(plan, "nothing", "ann")
        with pytest.raises(NoSuchChoice, match="door cannot be chosen at task/task/who; there is ann, bob, cat"):
            explainer.why_not(plan, "task/task/who", "door")
        with pytest.raises(NoSuchChoice, match="is what the plan chooses"):
            explainer.why_not(plan, "task/task/who", chosen)


def test_what_is_explained_is_left_as_it_is(tue_lab: Snapshot) -> None:
    """The session goes on by its own plan; nothing of what was supposed remains."""
    body: Term = [pick("who", call("lift", "Lift", ROBOT, "red")), pick("then", call("w", "Work", ROBOT))]
    with asked(tue_lab, body) as (session, explainer):
        plan = planned(session)
        explainer.why(plan)
        explainer.why_not(plan, "task/task/who", "cat")
        started = [e.action for e in session.next_actions(now_s=0.0).events if isinstance(e, Started)]
        assert started == [plan.steps[0].action]
        for number in range(1, 20):
            with pytest.raises(PrologError, match="session"):
                _needed_travels(f"task?{number}")
            with pytest.raises(PrologError):  # no facts of its own either
                _open_session(struct("request", "probe", f"task?{number}", "Main", 3, 0))


def test_a_request_that_is_under_way(tue_lab: Snapshot) -> None:
    """What is done is done: only what remains is asked about, from now on."""
    body: Term = [call("w", "Work", "ann"), call("lift", "Lift", "bob", "red"), pick("last", call("v", "Work", ROBOT))]
    with asked(tue_lab, body) as (session, _):
        planned(session)
        [started] = [e.action for e in session.next_actions(now_s=0.0).events if isinstance(e, Started)]
        [begun] = [e.action for e in session.succeeded(started, {}, now_s=2.5).events if isinstance(e, Started)]
        plan = session.plan(travel_of(TIMES), now_s=3.0)
        explained = Explainer(session, travel_of(TIMES), now_s=3.0).why(plan)
    lift, work = explained.starts
    assert (lift.step, lift.cause, lift.start_s, lift.end_s) == (begun.id, Cause.BEGINNING, 3.0, 3.5)
    assert (work.cause, work.waits_for) == (Cause.PROGRAM, (lift.step,))
    [last] = explained.choices
    assert {a.label: a.makespan_s for a in last.alternatives} == {"bob": 2.5, "cat": 2.5}


def test_no_other_choice_beats_an_optimal_plan(tue_lab: Snapshot) -> None:
    """Over random programs; and whatever starts late waits for something that ends then."""
    alternatives = starts = 0
    for seed in range(200):
        job = random_job(tue_lab, seed)
        if any(word in render(job.yard.definitions[-1]) for word in _LOOPS):
            continue  # their alternatives take the exact search long
        with asked_in(job.yard, robots=job.robots, times=job.times) as (session, _):
            plan = planned(session, job.times)
            explained = Explainer(session, travel_of(job.times), now_s=0.0, most_plans=6).why(plan)
        if not plan.solved:
            continue
        assert plan.status is PlanStatus.SOLVED_OPTIMALLY
        bests = [a.makespan_s for c in explained.choices for a in c.alternatives if a.makespan_s is not None]
        assert all(s >= plan.makespan_s for s in bests), f"seed {seed}"
        late = [s for s in explained.starts if s.cause is not Cause.BEGINNING]
        ends = {s.step: s.end_s for s in explained.starts}
        assert all(
            s.waits_for and {round(1000 * ends[w]) for w in s.waits_for} == {round(1000 * s.start_s)} for s in late
        ), f"seed {seed}"
        assert explained.critical or not explained.starts
        alternatives, starts = alternatives + len(bests), starts + len(late)
    assert alternatives > 10
    assert starts > 20
