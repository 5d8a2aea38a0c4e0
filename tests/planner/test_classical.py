"""Goals: what shall be true, planned by the engines of unified-planning and costed by hand here."""

from __future__ import annotations

import contextlib
import functools
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from unified_planning.io import PDDLReader

from kb.errors import DependencyMissing
from kb.files import SHIPPED
from kb.prolog import PrologError
from kb.store import KnowledgeBase, Snapshot
from kb.terms import Struct, render
from planner.classical import GoalPlan, parse_goal, solve
from planner.classical_engine import ARIES, Engine, require_engines
from planner.classical_export import BadPlanText, agrees, export_goal, export_task, goal_problem, import_plan
from planner.classical_goal import BadGoal
from planner.classical_operators import offered
from planner.classical_process import PROCESS, GoalProcess
from planner.classical_recipe import as_owl
from planner.classical_tasks import CannotExport, task_problem
from planner.errors import InvalidPlan
from planner.network import NO_WAY, Travel
from planner.plan import PlanStatus
from planner.planner import Session, TravelTimes

_SPEEDS_MPS = {"amigo_1": 0.7, "pico_1": 0.6}
_STARTS = {"amigo_1": "start_west", "pico_1": "start_east"}
_DRIVE_MS = 1500
"""What Navigate takes beside its way."""
_FIND_MS = 1649
"""What SearchDrink takes beside its way."""
_BASE = "http://example.org/concertmaster"

Said = dict[str, str | int | float | bool]


def _individual(name: str, kind: str, **said: str | int | float | bool) -> str:
    """An individual of tea.owl; `a__b` says property a for the second time."""
    lines = []
    for prop, value in said.items():
        prop = prop.partition("__")[0]
        if isinstance(value, str) and value[0] == "#":
            file = "" if value.startswith("#Fill") else f"{_BASE}/{'objects' if value == '#Drink' else 'core'}.owl"
            file = file or f"{_BASE}/tea.owl"
            lines.append(f'<core:{prop} rdf:resource="{file}{value}"/>')
        else:
            sort = {bool: "boolean", int: "integer", float: "double", str: "string"}[type(value)]
            typed = f"http://www.w3.org/2001/XMLSchema#{sort}"
            lines.append(f'<core:{prop} rdf:datatype="{typed}">{str(value).lower()}</core:{prop}>')
    typed = f'<rdf:type rdf:resource="{_BASE}/core.owl#{kind}"/>'
    return f'<owl:NamedIndividual rdf:about="{_BASE}/tea.owl#{name}">{typed}{"".join(lines)}</owl:NamedIndividual>\n'


def _tea() -> str:
    """Two robots together fill a drink, in the east of the lab, at a machine; every other time they spill it."""
    parameters = {"robot": "#Robot", "helper": "#Robot", "drink": "#Drink", "machine": "#PhysicalObject"}
    parts = [
        _individual(
            f"Fill_{name}",
            "RobotParameter" if kind == "#Robot" else "Input",
            parameterName=name,
            parameterNumber=10 * number,
            parameterType=kind,
        )
        for number, (name, kind) in enumerate([*parameters.items(), ("location", "#Location")], start=1)
    ]
    for who in ("robot", "helper"):
        at: Said = {"subjectParameter": f"#Fill_{who}", "ofProperty": "#locatedAt", "objectParameter": "#Fill_location"}
        parts.append(_individual(f"Fill_{who}_there", "Holds", **at))
    east: Said = {"subjectParameter": "#Fill_location", "ofProperty": "#poseX_m", "comparison": "more", "hasValue": 8.0}
    parts.append(_individual("Fill_east", "Compare", **east))
    full: Said = {"subjectParameter": "#Fill_drink", "ofProperty": "#isEmpty", "hasValue": False}
    parts.append(_individual("Fill_full", "Effect", **full))
    inputs: Said = {f"hasInput__{n}": f"#Fill_{n}" for n in [*parameters, "location"]}
    asked: Said = {f"hasPrecondition__{n}": f"#Fill_{n}" for n in ("robot_there", "helper_there", "east")}
    more: Said = {"hasEffect": "#Fill_full", "claimsParameter": "#Fill_machine", "duration_s": 10.0, "successOdds": 0.5}
    parts.append(_individual("Fill", "AtomicProcess", **inputs, **asked, **more))
    service: Said = {"grounds": "#Fill", "serviceName": "/{robot}/fill", "timeout_s": 60.0}
    parts.append(_individual("Fill_service", "RobotGrounding", **service))
    return (
        f'<?xml version="1.0"?>\n<rdf:RDF xml:base="{_BASE}/tea.owl" xmlns:core="{_BASE}/core.owl#"\n'
        ' xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">\n'
        f'<owl:Ontology rdf:about="{_BASE}/tea.owl"><owl:imports rdf:resource="{_BASE}/objects.owl"/></owl:Ontology>\n'
        f"{''.join(parts)}</rdf:RDF>\n"
    )


def _with(to: Path, name: str, owl: str) -> Path:
    """A copy of the shipped ontologies whose site imports one more file of tasks."""
    shutil.copytree(SHIPPED, to)
    (to / "tasks" / f"{name}.owl").write_text(owl, encoding="utf-8")
    site = to / "sites" / "tue_lab" / "tue_lab.owl"
    imports = f'<owl:imports rdf:resource="{_BASE}/objects.owl"/>'
    text = site.read_text(encoding="utf-8")
    assert imports in text
    site.write_text(text.replace(imports, imports + imports.replace("objects", name)), encoding="utf-8")
    return to


@pytest.fixture(scope="session")
def lab() -> Iterator[Snapshot]:
    """amigo_1, pico_1, two drinks."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge.snapshot()
    knowledge.close()


@pytest.fixture(scope="session")
def travel(lab: Snapshot) -> Travel:
    """Robots drive along the axes; what they don't know of where they are costs them 0.1 s."""
    places = tuple(lab.ontology.individuals("Location"))
    at = {p: np.array([lab.ontology.value("poseX_m", p), lab.ontology.value("poseY_m", p)]) for p in places}
    far_m = np.array([[np.abs(at[a] - at[b]).sum() for b in places] for a in places])
    tables = {robot: np.rint(1000 * far_m / speed).astype(np.int64) for robot, speed in _SPEEDS_MPS.items()}
    return Travel(
        places=places,
        profile={robot: number for number, robot in enumerate(tables)},
        between=tuple(tables.values()),
        here={robot: table[places.index(_STARTS[robot])] + 100 for robot, table in tables.items()},
    )


Way = Callable[[str, str, str], int]


@pytest.fixture(scope="session")
def way_ms(travel: Travel) -> Way:
    """A function of (robot, from, to); from may be `here`."""

    def way(robot: str, origin: str, goal: str) -> int:
        column = travel.places.index(goal)
        if origin == "here":
            return int(travel.here[robot][column])
        return int(travel.between[travel.profile[robot]][travel.places.index(origin), column])

    return way


@pytest.fixture(scope="session")
def reach(lab: Snapshot, travel: Travel) -> Callable[[str], GoalPlan]:
    """A function of a goal."""
    return functools.cache(lambda goal: solve(parse_goal(goal, lab), lab, travel))


def test_offered(lab: Snapshot) -> None:
    """Processes that set something and whose duration is known are offered, the others with a reason not."""
    offer = offered(lab)
    operators = {o.process: o for o in offer.operators}
    assert sorted(operators) == ["Localize", "Navigate", "Relocalize", "SearchDrink"]
    assert operators["SearchDrink"].fixed_ms == _FIND_MS
    assert [e.prop for e in operators["SearchDrink"].effects] == ["locatedAt", "hasPoseEstimate", "hasDetectedPosition"]
    assert "foreach" in offer.refused["FindEachDrink"]
    assert "only another step can make" in offer.refused["Detection"]


def test_a_robot_at_a_place(reach: Callable[[str], GoalPlan], way_ms: Way) -> None:
    """It drives there, which is proven to be the fastest."""
    plan = reach("locatedAt(amigo_1)=at_bar")
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert plan.makespan_ms == way_ms("amigo_1", "here", "at_bar") + _DRIVE_MS
    assert plan.program is not None
    assert render(plan.program) == "call(Frame,goal_1,'Navigate'(amigo_1,kitchen,at_bar))"


def test_two_robots_at_places(reach: Callable[[str], GoalPlan], way_ms: Way) -> None:
    """Both drive at the same time."""
    plan = reach("locatedAt(amigo_1)=at_bar and locatedAt(pico_1)=at_cabinet")
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    ways = way_ms("amigo_1", "here", "at_bar"), way_ms("pico_1", "here", "at_cabinet")
    assert plan.makespan_ms == max(ways) + _DRIVE_MS
    assert isinstance(plan.program, Struct)
    assert plan.program.functor == "conc"


def test_a_drink_found(reach: Callable[[str], GoalPlan], way_ms: Way) -> None:
    """The robot that is there first looks where the drink should be."""
    plan = reach("hasDetectedPosition(drink_1)")
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert plan.makespan_ms == min(way_ms(r, "here", "at_coffee_table") for r in _STARTS) + _FIND_MS
    assert [(s.operator.process, s.binding["Location"]) for s in plan.steps] == [("SearchDrink", "at_coffee_table")]


@pytest.mark.slow
def test_two_drinks_found(reach: Callable[[str], GoalPlan], way_ms: Way) -> None:
    """A robot for each drink, as that is faster."""
    plan = reach("hasDetectedPosition(drink_1) and hasDetectedPosition(drink_2)")
    first, second = way_ms("amigo_1", "here", "at_coffee_table"), way_ms("pico_1", "here", "at_dining_table")
    assert plan.makespan_ms == max(first, second) + _FIND_MS
    assert {s.robots for s in plan.steps} == {("amigo_1",), ("pico_1",)}


@pytest.mark.slow
def test_found_and_back(reach: Callable[[str], GoalPlan], way_ms: Way) -> None:
    """Both drinks found and both robots where they were: they find one each and drive back."""
    plan = reach(
        "hasDetectedPosition(drink_1), hasDetectedPosition(drink_2), "
        "locatedAt(amigo_1)=start_west, locatedAt(pico_1)=start_east"
    )
    west = way_ms("amigo_1", "here", "at_coffee_table") + way_ms("amigo_1", "at_coffee_table", "start_west")
    east = way_ms("pico_1", "here", "at_dining_table") + way_ms("pico_1", "at_dining_table", "start_east")
    assert plan.makespan_ms == max(west, east) + _FIND_MS + _DRIVE_MS
    assert plan.status is PlanStatus.SOLVED_SATISFICING
    assert plan.bound_ms < plan.makespan_ms
    by_robot = {robot: [s for s in plan.steps if s.robots == (robot,)] for robot in _STARTS}
    for steps in by_robot.values():
        assert [s.operator.process for s in steps] == ["SearchDrink", "Navigate"]
        assert steps[0].end_ms == steps[1].start_ms


def test_negation(reach: Callable[[str], GoalPlan], travel: Travel, way_ms: Way) -> None:
    """To be anywhere else, a robot drives to what is nearest."""
    plan = reach("not locatedAt(amigo_1)=start_west")
    nearest = min(way_ms("amigo_1", "here", p) for p in travel.places if p != "start_west")
    assert plan.makespan_ms == nearest + _DRIVE_MS
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY


def test_holds_already(reach: Callable[[str], GoalPlan]) -> None:
    """There is nothing to do for what is true."""
    plan = reach("locatedAt(amigo_1)=start_west and locatedAt(pico_1)!=start_west")
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert (plan.makespan_ms, plan.steps, plan.program) == (0, (), [])


def test_nobody_can(reach: Callable[[str], GoalPlan]) -> None:
    """What no process brings about is proven to be impossible, without search."""
    plan = reach("locatedAt(drink_1)=at_bar")
    assert plan.status is PlanStatus.UNSOLVABLE_PROVEN
    assert plan.program is None
    assert (
        plan.reason
        == "Navigate and SearchDrink set locatedAt, but not of drink_1: locatedAt(drink_1) cannot become at_bar"
    )


def test_no_way(lab: Snapshot, travel: Travel) -> None:
    """A place that no way leads to is out of reach."""
    column = travel.places.index("at_bar")

    def blocked(table: np.ndarray) -> np.ndarray:
        table = table.copy()
        table[..., column] = NO_WAY
        return table

    cut = replace(
        travel, between=tuple(map(blocked, travel.between)), here={r: blocked(row) for r, row in travel.here.items()}
    )
    plan = solve(parse_goal("locatedAt(amigo_1)=at_bar", lab), lab, cut)
    assert plan.status is PlanStatus.UNSOLVABLE_PROVEN
    assert "locatedAt(amigo_1) cannot become at_bar" in plan.reason


def test_one_or_the_other(lab: Snapshot, travel: Travel) -> None:
    """Each part can be reached, but not both: the search through all states proves it."""
    row = travel.places.index("at_coffee_table")
    trap = travel.between[0].copy()
    trap[row, :] = NO_WAY
    nowhere = np.full(len(travel.places), NO_WAY)
    alone = replace(travel, between=(trap, trap), here={"amigo_1": travel.here["amigo_1"], "pico_1": nowhere})
    plan = solve(parse_goal("hasDetectedPosition(drink_1) and locatedAt(amigo_1)=at_bar", lab), lab, alone)
    assert plan.status is PlanStatus.UNSOLVABLE_PROVEN
    assert "pyperplan" in plan.reason


@pytest.mark.parametrize(
    ("goal", "says"),
    [
        ("", "say what shall be true"),
        ("bring me a drink", "cannot be read"),
        ("locatedat(amigo_1)=at_bar", "did you mean locatedAt?"),
        ("locatedAt(amigo1)=at_bar", "did you mean amigo_1?"),
        ("locatedAt(amigo_1)=at_bat", "did you mean at_bar?"),
        ("locatedAt(amigo_1)=kitchen", "kitchen is a Room; locatedAt has Location"),
        ("locatedAt(amigo_1)", "lacks a value"),
        ("hasDetectedPosition(drink_1)=at_bar", "are messages"),
        ("locatedAt(amigo_1)=at_bar and locatedAt(amigo_1)=at_cabinet", "one value at a time"),
    ],
)
def test_bad_goals(goal: str, says: str, lab: Snapshot) -> None:
    """The message tells what would be right."""
    with pytest.raises(BadGoal) as refused:
        parse_goal(goal, lab)
    assert says in str(refused.value)


def test_other_forms(lab: Snapshot) -> None:
    """A goal may be given as a list or a mapping, too."""
    goal = parse_goal("locatedAt(amigo_1)=at_bar and hasDetectedPosition(drink_1)", lab)
    assert parse_goal(["locatedAt(amigo_1)=at_bar", "hasDetectedPosition(drink_1)"], lab) == goal
    assert parse_goal({"locatedAt(amigo_1)": "at_bar", "hasDetectedPosition(drink_1)": None}, lab) == goal
    assert parse_goal({"isEmpty(drink_1)": False}, lab).text == "isEmpty(drink_1)=false"
    assert goal.names == {"amigo_1", "at_bar", "drink_1"}


_FOUND_AT_BAR = "hasDetectedPosition(drink_1) and locatedAt(amigo_1)=at_bar"


@pytest.mark.slow
def test_validator_agrees(reach: Callable[[str], GoalPlan], lab: Snapshot, travel: Travel) -> None:
    """unified-planning's validator accepts our plans, and not one that is cut short."""
    plan = reach(_FOUND_AT_BAR)
    assert agrees(plan, lab, travel) == ""
    assert agrees(replace(plan, steps=plan.steps[:1]), lab, travel) != ""


@pytest.mark.slow
def test_pddl_and_back(reach: Callable[[str], GoalPlan], lab: Snapshot, travel: Travel, tmp_path: Path) -> None:
    """Another planner's plan for the exported problem becomes one of ours."""
    goal = parse_goal(_FOUND_AT_BAR, lab)
    domain, problem = export_goal(goal, lab, travel, tmp_path / "found.pddl")
    assert (domain.name, problem.name) == ("found_domain.pddl", "found.pddl")
    read = PDDLReader().parse_problem(str(domain), str(problem))
    assert {a.name for a in read.actions} == {"localize", "navigate", "relocalize", "searchdrink"}
    text = """; made by hand
    0.0: (searchdrink amigo_1 drink_1 at_coffee_table profile_0 here_amigo_1 start_west) [9606]
    9606.1: (navigate amigo_1 at_bar profile_0 at_coffee_table at_coffee_table) [13357]"""
    plan = import_plan(text, goal, lab, travel)
    assert [s.operator.process for s in plan.steps] == ["SearchDrink", "Navigate"]
    assert plan.makespan_ms == 9606 + 13357
    assert plan.makespan_ms >= reach(_FOUND_AT_BAR).makespan_ms
    with pytest.raises(InvalidPlan, match="not as the goal wants it"):
        import_plan("(navigate amigo_1 at_bar profile_0 here_amigo_1 start_west)", goal, lab, travel)
    with pytest.raises(BadPlanText, match="line 1 of the plan names fly"):
        import_plan("(fly amigo_1 at_bar)", goal, lab, travel)


def test_anml(lab: Snapshot, travel: Travel, tmp_path: Path) -> None:
    """A goal can be written in ANML; what is no language is refused."""
    goal = parse_goal(_FOUND_AT_BAR, lab)
    [file] = export_goal(goal, lab, travel, tmp_path / "found.anml")
    assert "action SearchDrink" in file.read_text(encoding="utf-8")
    with pytest.raises(CannotExport, match=r"not as \.txt"):
        export_goal(goal, lab, travel, tmp_path / "found.txt")


def test_task_in_hddl(lab: Snapshot, travel: Travel, tmp_path: Path) -> None:
    """A task becomes tasks and methods: for each drink of the room, a robot is picked."""
    files = export_task("FindEmptyDrink", {"room": "tue_lab"}, lab, travel, tmp_path / "find.hddl")
    domain, problem = (file.read_text(encoding="utf-8") for file in files)
    assert "(searchdrink ?robot__1 drink_1 at_coffee_table" in domain
    assert "(searchdrink ?robot__2 drink_2 at_dining_table" in domain
    assert "(findemptydrink__1 )" in problem
    again = export_task("FindEmptyDrink", {"room": "tue_lab"}, lab, travel, tmp_path / "again.hddl")
    assert again[0].read_text(encoding="utf-8") == domain


def test_task_by_aries(lab: Snapshot, travel: Travel, way_ms: Way) -> None:
    """Aries proves the optimum of a task without loops: a robot for each drink."""
    problem = task_problem("FindEmptyDrink", {"room": "tue_lab"}, lab, travel)
    with Engine(ARIES, problem, timeout_s=30.0) as engine:
        answers = list(engine.answers())
    assert answers[-1].note == "SOLVED_OPTIMALLY"
    actions = answers[-1].actions
    assert actions is not None
    first, second = way_ms("amigo_1", "here", "at_coffee_table"), way_ms("pico_1", "here", "at_dining_table")
    assert max(a.start + a.duration for a in actions if a.start is not None and a.duration is not None) == (
        max(first, second) + _FIND_MS
    )


def test_task_that_senses(lab: Snapshot, travel: Travel) -> None:
    """What decides on what only acting finds out is an action only where it has a duration."""
    problem = task_problem("Navigate", {"robot": "amigo_1", "area": "kitchen", "location": "at_bar"}, lab, travel)
    assert "Navigate" in {a.name for a in problem.actions}


def test_engine_ends(lab: Snapshot, travel: Travel) -> None:
    """Leaving an engine in the middle leaves no process behind."""
    impossible = parse_goal("locatedAt(drink_1)=at_bar", lab)  # aries would look for ever
    with Engine(ARIES, goal_problem(impossible, lab, travel), timeout_s=30.0) as engine:
        assert next(engine.answers()).actions is None
        group = engine.group
        assert _alive(group)
    assert any(not _alive(group) for _ in range(1000))  # the kernel takes a moment


def _alive(group: int) -> list[int]:
    """The processes of a group, without those that are dead and wait for their burial."""
    alive = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            state, _, its_group = stat.read_text(encoding="utf-8").rpartition(")")[2].split()[:3]
            if int(its_group) == group and state != "Z":
                alive.append(int(stat.parent.name))
    return alive


@pytest.mark.parametrize(
    ("goal", "inputs", "awaited"),
    [
        ("hasDetectedPosition(drink_1)", {"drink1": "drink_1"}, ""),
        (
            "hasDetectedPosition(drink_1), locatedAt(amigo_1)=at_bar",
            {"amigo1": "amigo_1", "atBar": "at_bar", "drink1": "drink_1"},
            "test(holds(locatedAt,Amigo1,AtBar))",
        ),
        pytest.param(
            "hasDetectedPosition(drink_1), hasDetectedPosition(drink_2), not isEmpty(drink_1)=false, "
            "locatedAt(amigo_1)=start_west, not locatedAt(drink_1)=at_bar",
            {"amigo1": "amigo_1", "startWest": "start_west", "drink1": "drink_1", "drink2": "drink_2"},
            "test(all([not(holds(isEmpty,Drink1,false)),holds(locatedAt,Amigo1,StartWest)]))",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_recipe(
    goal: str,
    inputs: dict[str, str],
    awaited: str,
    reach: Callable[[str], GoalPlan],
    lab: Snapshot,
    tmp_path: Path,
    travel: Travel,
) -> None:
    """A plan that is kept as a recipe is a task type that ends as the goal asks, and takes no longer than the plan."""
    plan = reach(goal)
    knowledge = KnowledgeBase("tue_lab", _with(tmp_path / "ontologies", "keep_it", as_owl(plan, "KeepIt", lab)))
    snapshot = knowledge.snapshot()
    assert awaited in snapshot.program("KeepIt").text
    assert awaited or "test(" not in snapshot.program("KeepIt").text
    given = {p.name: inputs[p.name] for p in snapshot.processes["KeepIt"].inputs}
    session = Session("kept", snapshot, "KeepIt", given, robots=2)
    kept = session.plan(travel_times(travel), now_s=0.0)
    session.close()
    knowledge.close()
    assert kept.status is PlanStatus.SOLVED_OPTIMALLY
    least_ms = round(1000 * kept.makespan_s)
    assert plan.bound_ms <= least_ms <= plan.makespan_ms


def test_names_of_recipes(reach: Callable[[str], GoalPlan], lab: Snapshot) -> None:
    """A recipe needs a name that nothing else has, and steps."""
    plan = reach("hasDetectedPosition(drink_1)")
    for name, says in (("Navigate", "something else already"), ("find it", "no name for a process")):
        with pytest.raises(BadGoal, match=says):
            as_owl(plan, name, lab)
    with pytest.raises(BadGoal, match="there are no steps to keep"):
        as_owl(reach("locatedAt(amigo_1)=start_west"), "KeepIt", lab)


def test_a_plan_is_a_process_of_its_own(reach: Callable[[str], GoalPlan], lab: Snapshot, travel: Travel) -> None:
    """A session performs it, checked like any other, from what is told; nothing of it is left behind."""
    plan = reach("hasDetectedPosition(drink_1) and locatedAt(amigo_1)=at_bar")
    told = replace(lab, fluents={**lab.fluents, ("locatedAt", "drink_1"): "at_cabinet"})
    for snapshot, solved in ((lab, True), (told, False)):
        process = GoalProcess(plan, snapshot)
        session = Session("goal", process.snapshot, PROCESS, {}, robots=2)
        made = session.plan(travel_times(travel), now_s=0.0)
        session.close()
        process.close()
        assert made.solved is solved, "the drink is not where the plan looks for it"
        assert not solved or round(1000 * made.makespan_s) == plan.makespan_ms
        with pytest.raises(PrologError):
            Session("goal", process.snapshot, PROCESS, {}, robots=2)
    assert PROCESS not in lab.processes


def test_missing_engines(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says what to install."""
    monkeypatch.setitem(sys.modules, "up_aries", None)  # as if it could not be found
    with pytest.raises(DependencyMissing, match=r"goals need the planner aries.*pip install 'concertmaster\[goals\]'"):
        require_engines()


def travel_times(travel: Travel) -> TravelTimes:
    """The table as a session asks for it: for some robots, to some places."""

    def times(robots: Sequence[str], places: Sequence[str]) -> Travel:
        to = [travel.places.index(place) for place in places]
        return Travel(
            places=tuple(places),
            profile={robot: travel.profile[robot] for robot in robots},
            between=tuple(table[np.ix_(to, to)] for table in travel.between),
            here={robot: travel.here[robot][to] for robot in robots},
        )

    return times


@pytest.mark.slow
def test_together(travel: Travel, way_ms: Way, tmp_path: Path) -> None:
    """Two robots, a claimed machine, numbers that are compared, and odds: all of it in one step."""
    knowledge = KnowledgeBase("tue_lab", _with(tmp_path / "ontologies", "tea", _tea()))
    snapshot = knowledge.snapshot()
    plan = solve(parse_goal("isEmpty(drink_1)=false", snapshot), snapshot, travel)
    knowledge.close()
    # pico_1 is in the east already.
    assert plan.makespan_ms == way_ms("amigo_1", "here", "start_east") + _DRIVE_MS + 2 * 10_000
    assert [s.operator.process for s in plan.steps] == ["Navigate", "Fill"]
    assert set(plan.steps[1].robots) == {"amigo_1", "pico_1"}
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert agrees(plan, snapshot, travel) == ""
    with Engine(ARIES, goal_problem(plan.goal, snapshot, travel), timeout_s=30.0) as engine:
        answers = [answer.actions for answer in engine.answers() if answer.actions]
    assert answers[-1][-1].name == "Fill"
    assert answers[-1][-1].duration == 2 * 10_000
