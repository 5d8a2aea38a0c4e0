"""Goals: as requests, in the core of the executive, and on the command line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from executive import Fleet, events, loop
from executive.cli import main
from executive.errors import BadRequest
from executive.goals import check_goal, recipe_file
from executive.request import TaskRequest
from executive.trace import FleetOpened, GoalSolved, PlanFailed, TaskAccepted, narrate
from kb.errors import DependencyMissing
from kb.files import SHIPPED
from kb.store import Snapshot
from kb.terms import struct
from planner.classical_goal import BadGoal, Goal, GoalPlan, GoalStep
from planner.classical_operators import Operator
from planner.plan import PlanStatus
from tests.executive.made import after, others, recorded, requested

SWEPT = Goal(text="isSwept(attic)", conditions=(struct("holds", "isSwept", "attic", True),))
SWEEP = Operator(
    process="Sweep",
    arguments=(),
    kinds={},
    robots=("r1",),
    requires=(),
    conditions=(),
    effects=(),
    legs=(),
    fixed_ms=2000,
    claims=(),
)


def asked(task: str) -> events.Requested:
    """A request for a goal."""
    request = TaskRequest(process="reach goal", arguments={}, robots=2, goal=SWEPT)
    return events.Requested(task=task, request=request)


def solved(task: str, status: PlanStatus, *steps: GoalStep, reason: str) -> events.GoalWasSolved:
    """What came of it."""
    program = ["Sweep"] if steps else []
    plan = GoalPlan(
        goal=SWEPT,
        status=status,
        makespan_ms=2000 if steps else 0,
        bound_ms=2000 if steps else 0,
        steps=steps,
        program=None if status is PlanStatus.UNSOLVABLE_PROVEN else [*program],
        engine="a broom",
        reason=reason,
    )
    return events.GoalWasSolved(task=task, plan=plan)


STEP = GoalStep(name="goal_1", operator=SWEEP, binding={}, head="Sweep", robots=("r1",), start_ms=0, end_ms=2000)
READ = events.KnowledgeWasRead(task="one", facts_told=0)


# In the core


def test_a_goal_is_solved_before_its_program_is_compiled() -> None:
    """Knowledge, solution, program: the trace tells the goal, and what solved it."""
    _, commands = after(asked("one"))
    [accepted] = [event for event in recorded(commands) if isinstance(event, TaskAccepted)]
    assert accepted.goal == "isSwept(attic)"
    assert next(narrate([accepted])) == "one accepted: isSwept(attic), at most 2 robots"
    _, commands = after(asked("one"), READ)
    assert others(commands) == [events.SolveGoal(task="one")]
    found = solved("one", PlanStatus.SOLVED_OPTIMALLY, STEP, reason="two seconds is the least")
    _, commands = after(asked("one"), READ, found, now_s=3.0)
    assert others(commands) == [events.CompileProgram(task="one")]
    [event] = recorded(commands)
    assert isinstance(event, GoalSolved)
    assert (event.engine, event.makespan_s, event.lower_bound_s) == ("a broom", 2.0, 2.0)
    assert next(narrate([event])) == "one solved at time 3.00: SOLVED_OPTIMALLY, two seconds is the least"


def test_a_task_type_is_not_solved() -> None:
    """It has its program already."""
    _, commands = after(requested("one"), READ)
    assert others(commands) == [events.CompileProgram(task="one")]


def test_a_goal_that_holds_is_completed_at_once() -> None:
    """With the reason, and the next task begins."""
    found = solved("one", PlanStatus.SOLVED_OPTIMALLY, reason="the goal holds already")
    state, commands = after(asked("one"), requested("two"), READ, found)
    [finish] = [command for command in commands if isinstance(command, events.FinishTask)]
    assert (finish.status, finish.reason) == (events.TaskStatus.COMPLETED, "the goal holds already")
    assert list(state.tasks) == ["two"]
    assert isinstance(others(commands)[-1], events.ReadKnowledge)


def test_a_goal_out_of_reach_is_refused() -> None:
    """The trace says why."""
    state, commands = after(asked("one"), READ, solved("one", PlanStatus.UNSOLVABLE_PROVEN, reason="there is no broom"))
    [finish] = others(commands)
    assert isinstance(finish, events.FinishTask)
    assert (finish.status, finish.reason) == (events.TaskStatus.REFUSED, "there is no broom")
    [failed] = [event for event in recorded(commands) if isinstance(event, PlanFailed)]
    assert failed.reason == "there is no broom"
    assert not state.tasks


def test_what_was_solved_for_a_canceled_task_leads_to_nothing() -> None:
    """It came too late."""
    state, _ = after(asked("one"), READ, events.CancelRequested(task="one"))
    late = solved("one", PlanStatus.SOLVED_OPTIMALLY, STEP, reason="two seconds is the least")
    assert loop.step(state, late, 9.0) == (state, [])


# As requests


def test_a_goal_is_a_request_for_all_robots(snapshot: Snapshot) -> None:
    """Whatever form it is given in."""
    request = check_goal({"locatedAt(amigo_1)": "at_bar", "hasDetectedPosition(drink_1)": None}, snapshot)
    assert request.goal is not None
    assert request.goal.text == "locatedAt(amigo_1)=at_bar and hasDetectedPosition(drink_1)"
    assert request.robots == 2


def test_without_the_extra_a_goal_is_not_accepted(snapshot: Snapshot, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message has the command that installs it."""
    monkeypatch.setitem(sys.modules, "up_pyperplan", None)  # as if it could not be found
    with pytest.raises(DependencyMissing, match=r"pip install 'concertmaster\[goals\]'"):
        check_goal("locatedAt(amigo_1)=at_bar", snapshot)


def test_a_closed_fleet_takes_no_goals() -> None:
    """It says so; a goal that makes no sense leaves nothing in the trace of an open one."""
    with Fleet.open("tue_lab") as fleet:
        with pytest.raises(BadGoal, match=r"did you mean at_bar\?"):
            fleet.request_goal("locatedAt(amigo_1)=at_bat")
        assert [type(event) for event in fleet.trace] == [FleetOpened]
    with pytest.raises(BadRequest, match="this fleet is closed"):
        fleet.request_goal("locatedAt(amigo_1)=at_bar")


def test_nobody_waits_for_unified_planning_who_has_no_goal() -> None:
    """It takes a second to import, so that is left to the first goal."""
    told = subprocess.run(
        [sys.executable, "-c", "import sys, executive.cli; print('unified_planning' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert told.stdout == "False\n"


# On the command line


def test_plan_tells_what_leads_to_a_goal_and_keeps_it(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Status, steps and the file of the recipe; a second recipe of the name is refused."""
    goal = ["plan", "--goal", "locatedAt(pico_1)=at_bar", "--store", "GoThere"]
    assert main([*goal, "--knowledge", str(knowledge)]) == 0
    status, step, recipe = capsys.readouterr().out.splitlines()
    assert status.startswith("SOLVED_OPTIMALLY: makespan ")
    assert step.startswith('  [Navigate(pico_1,"kitchen","at_bar")] from 0.50 to ')
    file = knowledge / "tasks" / "go_there.owl"
    assert recipe == f"recipe:   {file}"
    before = file.read_bytes()
    assert b"GoThere" in before
    assert main([*goal, "--knowledge", str(knowledge)]) == 2
    assert f"{file} is there already; choose another name" in capsys.readouterr().err
    assert file.read_bytes() == before


def test_a_goal_that_holds_needs_no_plan(capsys: pytest.CaptureFixture[str]) -> None:
    """One line, status 0."""
    assert main(["plan", "--goal", "locatedAt(amigo_1)=start_west"]) == 0
    assert capsys.readouterr().out == "SOLVED_OPTIMALLY: the goal holds already\n"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--goal", "locatedAt(amigo1)=at_bar"], "did you mean amigo_1?"),
        (["--goal", "locatedAt(amigo_1)=kitchen"], "kitchen is a Room; locatedAt has Location"),
        (["--goal", ""], "say what shall be true"),
        (["--goal", "locatedAt(amigo_1)=at_bar", "--robots", "1"], "leave --robots out"),
        (["FindEmptyDrink", "room=kitchen", "--store", "Again"], "give --goal as well"),
        (["--goal", "locatedAt(amigo_1)=at_bar", "--folder", "here"], "give --store NAME as well"),
        (["--goal", "locatedAt(amigo_1)=at_bar", "--store", "GoThere"], "the shipped ontologies are not changed"),
        (["--goal", "locatedAt(amigo_1)=at_bar", "--store", "Navigate"], "is the name of something else already"),
        (
            ["--goal", "locatedAt(amigo_1)=at_bar", "--store", "GoThere", "--folder", "nowhere"],
            "no folder of ontologies",
        ),
    ],
)
@pytest.mark.parametrize("command", ["plan", "run"])
def test_bad_goals_end_with_2(
    command: str,
    arguments: list[str],
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The message tells what would be right; nothing is printed on stdout."""
    monkeypatch.chdir(tmp_path)
    assert main([command, *arguments]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert says in told.err


def test_a_goal_out_of_reach_ends_with_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`plan` tells it as the status, `run` as the reason of the refusal."""
    monkeypatch.chdir(tmp_path)
    goal = ["--goal", "locatedAt(drink_1)=at_bar"]
    assert main(["plan", *goal]) == 2
    assert capsys.readouterr().out.startswith("UNSOLVABLE_PROVEN: Navigate and SearchDrink set locatedAt, but not of")
    assert main(["run", *goal]) == 2
    assert "Goal-1 was refused: Navigate and SearchDrink set locatedAt" in capsys.readouterr().err


@pytest.mark.slow
def test_run_keeps_what_it_has_done_as_a_recipe(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """After the goal was reached; the recipe can be imported, asked for and planned."""
    out = ["--out", str(knowledge.parent / "out")]
    goal = ["run", "--goal", "hasDetectedPosition(drink_2)", "--store", "FindIt", "--folder", str(knowledge), *out]
    assert main(goal) == 0
    assert capsys.readouterr().out.endswith(f"recipe:   {knowledge / 'tasks' / 'find_it.owl'}\n")
    site = knowledge / "sites" / "tue_lab" / "tue_lab.owl"
    imports = '<owl:imports rdf:resource="http://example.org/concertmaster/objects.owl"/>'
    text = site.read_text(encoding="utf-8")
    assert text.count(imports) == 1
    site.write_text(text.replace(imports, imports + imports.replace("objects", "find_it")), encoding="utf-8")
    assert main(["plan", "FindIt", "drink2=drink_1", "--knowledge", str(knowledge)]) == 0
    assert '[Detection(amigo_1,"drink_1")]' in capsys.readouterr().out


def test_recipes_stay_out_of_the_shipped_folder(snapshot: Snapshot) -> None:
    """However it is named."""
    for folder in (SHIPPED, SHIPPED / "tasks" / "..", SHIPPED / "core"):
        with pytest.raises(BadRequest, match="not changed"):
            recipe_file("GoThere", folder, snapshot)
