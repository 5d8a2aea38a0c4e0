"""A plan for a goal is kept as a recipe; the site imports it, and a later task is done by it, as that is faster."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.cli import main
from executive.trace import GoalSolved, PlanMade, ProcessBegun
from kb.files import SHIPPED
from kb.recipes import import_recipe, recipes, retire
from planner.classical_goal import BadGoal
from tests.scenarios.see_drink import write_see_drink


@pytest.fixture
def knowledge(tmp_path: Path) -> Path:
    """The shipped ontologies, and the task type SeeDrink with a slow recipe."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    import_recipe(folder, "tue_lab", write_see_drink(folder))
    return folder


@pytest.mark.slow
def test_a_later_task_uses_what_was_found_for_a_goal(knowledge: Path) -> None:
    """The recipe tells where it comes from; the trace shows that it is chosen, also for the other drink."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        goal = fleet.request_goal("hasDetectedPosition(drink_1)")
        done = goal.wait()
        assert done.status is TaskStatus.COMPLETED
        assert done.goal is not None
        kept_at_s = fleet.now_s
        file = fleet.store_recipe(done.goal, "LookOnce", knowledge, realizes="SeeDrink")
        digest = fleet.parts.knowledge.snapshot().ontology.files.digest
        [solved] = [e for e in fleet.trace if isinstance(e, GoalSolved)]
    [recipe] = import_recipe(knowledge, "tue_lab", file)
    assert (recipe.name, recipe.realizes, recipe.goal) == ("LookOnce", ("SeeDrink",), "hasDetectedPosition(drink_1)")
    assert (recipe.kept_at_s, recipe.makespan_s, recipe.knowledge) == (kept_at_s, solved.makespan_s, digest)
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        assert fleet.request("SeeDrink", drink="drink_2").wait().status is TaskStatus.COMPLETED
        begun = [e.process.partition("(")[0] for e in fleet.trace if isinstance(e, ProcessBegun)]
        [made] = [e for e in fleet.trace if isinstance(e, PlanMade)]
    assert "LookOnce" in begun
    assert "LookTwice" not in begun
    assert begun.count("SearchDrink") == 1
    retire(knowledge, "tue_lab", "LookOnce", because="to see what was before", superseded_by="LookTwice")
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        slower, _ = fleet.plan("SeeDrink", drink="drink_2")
        assert [r.name for r in recipes(fleet.parts.knowledge.snapshot().ontology) if r.retired] == ["LookOnce"]
    assert slower.makespan_s > made.makespan_s + 1


def test_recipes_are_reviewed_on_the_command_line(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Kept, listed as not imported, imported, used, retired, restored."""
    at = ["--knowledge", str(knowledge)]
    goal = ["plan", "--goal", "hasDetectedPosition(drink_1)", "--store", "LookOnce", "--realizes", "SeeDrink"]
    assert main([*goal, *at]) == 0
    file = knowledge / "tasks" / "look_once.owl"
    assert capsys.readouterr().out.endswith(f"recipe:   {file}\n")
    assert main(["kb", "recipes", "list", *at]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[::2][:2] == ["FindEachDrink: in use for FindEmptyDrink", "LookTwice: in use for SeeDrink"]
    assert told[-1] == f"{file}: not imported by tue_lab"
    assert main(["kb", "recipes", "import", str(file), *at]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[1] == "LookOnce: in use for SeeDrink"
    found = (
        r"  found for hasDetectedPosition\(drink_1\), makespan \d\.\d{3} s, kept at 0\.00 s, in knowledge [0-9a-f]{12}"
    )
    assert re.fullmatch(found, told[3])
    retiring = ["kb", "recipes", "retire", "LookTwice", "--superseded-by", "LookOnce", "--because", "slow"]
    assert main([*retiring, *at]) == 0
    told = capsys.readouterr().out.splitlines()
    assert (told[0], told[2:]) == (
        "LookTwice: retired for SeeDrink",
        ["  retired because slow", "  superseded by LookOnce"],
    )
    assert main(["kb", "recipes", "retire", "LookOnce", *at]) == 2
    assert "KB130 error SeeDrink" in capsys.readouterr().err
    assert main(["kb", "recipes", "restore", "LookTwice", *at]) == 0
    assert capsys.readouterr().out.startswith("LookTwice: in use for SeeDrink\n")


@pytest.mark.parametrize(
    ("realizes", "says"),
    [
        ("SearchDrink", "is no task type that recipes may realize; there is FindEmptyDrink, SeeDrink"),
        ("see drink!", "is no task type; write it as SeeDrink"),
        ("SeeDrink(bottle=drink_1)", "its inputs are drink"),
        ("SeeDrink(drink=drink_2)", "drink_2 is nothing that the recipe asks for; that is drink_1"),
        ("SeeDrink(drink)", "gives no input of SeeDrink a value"),
    ],
)
def test_a_recipe_is_kept_only_for_what_it_accomplishes(realizes: str, says: str, knowledge: Path) -> None:
    """The message tells what would be right, and no file is written."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        found, _ = fleet.plan_goal("hasDetectedPosition(drink_1)")
        with pytest.raises(BadGoal, match=re.escape(says)):
            fleet.store_recipe(found, "LookOnce", knowledge, realizes=realizes)
    assert not (knowledge / "tasks" / "look_once.owl").exists()


def test_an_individual_that_is_no_input_of_the_task_is_told(knowledge: Path) -> None:
    """A goal about two drinks is no way to see one."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        found, _ = fleet.plan_goal("hasDetectedPosition(drink_1) and hasDetectedPosition(drink_2)")
        with pytest.raises(BadGoal, match="drink_2, a Drink, is none of its inputs"):
            fleet.store_recipe(found, "LookBoth", knowledge, realizes="SeeDrink(drink=drink_1)")
        assert fleet.store_recipe(found, "LookBoth", knowledge).exists()


def test_what_a_recipe_is_for_is_told_with_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    """`--realizes` without `--store` is refused."""
    assert main(["plan", "--goal", "locatedAt(amigo_1)=at_bar", "--realizes", "SeeDrink"]) == 2
    assert "give --store NAME as well" in capsys.readouterr().err
