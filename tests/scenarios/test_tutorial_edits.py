"""The edits of the tutorial `Change what the robots know`, done to the files as it tells; the planner uses each."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from executive import Fleet
from tests.docs.pages import ROOT, blocks_of, commands_of
from tests.docs.test_commands import edit

PAGE = ROOT / "docs" / "tutorial" / "change-what-robots-know.md"


@pytest.fixture(scope="module")
def edited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a reader who has done all that the page tells."""
    folder = tmp_path_factory.mktemp("tutorial")
    for name in ("kb", "sim"):
        (folder / name).symlink_to(ROOT / name)
    for block in blocks_of(PAGE):
        if block.action:
            edit(folder, block)
        for command in commands_of(block):
            if command.line.split()[0] in {"cp", "sed"}:
                subprocess.run(["bash", "-c", command.line], cwd=folder, check=True)
    return folder


def plan_of(folder: Path, scenario: Path) -> tuple[dict[str, str], set[str], float]:
    """Who looks for which drink, the processes of the plan, and its makespan in seconds."""
    with Fleet.open("tue_lab", knowledge=folder, scenario=scenario) as fleet:
        plan, _ = fleet.plan("FindEmptyDrink", room="tue_lab")
    actions = [step.action for step in plan.steps]
    looks = {str(a.argument("drink")): a.robot or "" for a in actions if a.process == "Detection"}
    return looks, {a.process for a in actions}, plan.makespan_s


def test_the_planner_uses_the_new_robot_the_new_drink_and_the_new_recipe(edited: Path) -> None:
    """The robot takes over from Amigo, Amigo looks for the drink, nobody localizes twice."""
    looks, processes, _ = plan_of(edited / "my-knowledge", edited / "my-scenario.toml")
    assert looks == {"drink_1": "gripper_1", "drink_2": "pico_1", "drink_3": "amigo_1"}
    assert processes == {"Navigate", "Kinect", "Detection"}


def test_without_the_new_recipe_the_old_one_is_used_and_takes_longer(edited: Path, tmp_path: Path) -> None:
    """The import of the recipe is taken out again."""
    shutil.copytree(edited / "my-knowledge", tmp_path / "knowledge")
    site = tmp_path / "knowledge" / "sites" / "tue_lab" / "tue_lab.owl"
    lines = site.read_text(encoding="utf-8").splitlines(keepends=True)
    site.write_text("".join(line for line in lines if "glance.owl" not in line), encoding="utf-8")
    looks, processes, makespan_s = plan_of(tmp_path / "knowledge", edited / "my-scenario.toml")
    assert looks == {"drink_1": "gripper_1", "drink_2": "pico_1", "drink_3": "amigo_1"}
    assert "Laser" in processes
    assert makespan_s > plan_of(edited / "my-knowledge", edited / "my-scenario.toml")[2]


def test_the_new_class_has_the_new_capability_and_no_other_has(edited: Path) -> None:
    """The reasoner finds that who has a gripper is a RobotWithGripper."""
    with Fleet.open("tue_lab", knowledge=edited / "my-knowledge", scenario=edited / "my-scenario.toml") as fleet:
        assert fleet.parts.knowledge.snapshot().ontology.individuals("RobotWithGripper") == ["gripper_1"]
