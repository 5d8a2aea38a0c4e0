"""Who can do what: capabilities, what holds now, batteries, recipes; and why."""

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from kb.compiler import Compiler
from kb.derivation import Derivation, Reason, reason_lines
from kb.files import SHIPPED, read_files
from kb.names import UnknownName
from kb.ontology import close
from kb.pages.readiness import readiness_data, readiness_page
from kb.processes import read_processes
from kb.readiness import LackKind, Verdict, matrix, readiness, robot_classes, roles
from kb.store import KnowledgeBase
from kb.terms import Var, struct
from tests.kb.conftest import AMIGO, DOUBLE, IRI, SITE, TASK, ask, given, individual, instead, link
from tests.kb.process_graphs import SKILLED, Node, Program, graph_of, told, write


@pytest.fixture
def knowledge() -> Iterator[KnowledgeBase]:
    """A knowledge base of the shipped site that a test may tell things."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge
    knowledge.close()


@pytest.fixture(scope="module")
def odd(tmp_path_factory: pytest.TempPathFactory) -> Iterator[KnowledgeBase]:
    """Pico without a Kinect, Amigo with a small battery; Look is a task type that Kinect and Laser realize."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path_factory.mktemp("odd") / "ontologies"))
    pico = folder / "robots" / "pico.owl"
    blind = pico.read_text(encoding="utf-8").replace('core.owl#Kinect"', 'core.owl#LaserScanner"')
    pico.write_text(blind, encoding="utf-8")
    values = "".join(
        f'<rdfs:subClassOf><owl:Restriction><owl:onProperty rdf:resource="{IRI}core.owl#{prop}"/>'
        f"<owl:hasValue {DOUBLE}>{value}</owl:hasValue></owl:Restriction></rdfs:subClassOf>"
        for prop, value in (("energy_J", "1.0"), ("power_W", "100.0"))
    )
    instead(AMIGO, '<rdfs:comment xml:lang="en">A care', f'{values}<rdfs:comment xml:lang="en">A care')(folder)
    individual(TASK, "Look", "SimpleProcess", link("hasInput", TASK, "Look_robot"))(folder)
    number = '<core:parameterNumber rdf:datatype="http://www.w3.org/2001/XMLSchema#integer">10</core:parameterNumber>'
    kind = f'<core:parameterType rdf:resource="{IRI}core.owl#Robot"/>'
    name = "<core:parameterName>robot</core:parameterName>"
    individual(TASK, "Look_robot", "RobotParameter", name, number, kind)(folder)
    given(TASK, "Kinect", link("realizes", TASK, "Look"))(folder)
    given("tasks/navigation.owl", "Laser", link("realizes", TASK, "Look"))(folder)
    navigation = folder / "tasks" / "navigation.owl"
    text = navigation.read_text(encoding="utf-8")
    imported = f'<owl:imports rdf:resource="{IRI}find_empty_drink.owl"/>'
    navigation.write_text(text.replace("<owl:imports", f"{imported}<owl:imports", 1), encoding="utf-8")
    knowledge = KnowledgeBase("tue_lab", folder)
    yield knowledge
    knowledge.close()


def leaves(reason: Reason) -> Iterator[Reason]:
    """What a reason rests on in the end."""
    if not reason.because:
        yield reason
    for part in reason.because:
        yield from leaves(part)


def test_all_shipped_robots_can_do_all_tasks(shipped: KnowledgeBase) -> None:
    """And so can their classes."""
    snapshot = shipped.snapshot()
    assert robot_classes(snapshot) == ["Amigo", "Pico"]
    who = ["amigo_1", "pico_1", "Amigo", "Pico"]
    found = matrix(snapshot, who, ["FindEmptyDrink", "SearchDrink", "Navigate", "Localize"])
    assert {r.verdict for r in found} == {Verdict.ABLE}
    assert [r.who for r in found[::4]] == who


def test_the_role_is_a_parameter_or_a_pick(shipped: KnowledgeBase) -> None:
    """FindEmptyDrink picks its robots, SearchDrink is given one."""
    snapshot = shipped.snapshot()
    [picked], [own] = roles(snapshot, "FindEmptyDrink"), roles(snapshot, "SearchDrink")
    assert (picked.parameter.name, picked.program is None) == ("robot", False)
    assert (own.process, own.parameter.name, own.program) == ("SearchDrink", "robot", None)


def test_a_missing_sensor_is_named_with_who_asks(odd: KnowledgeBase) -> None:
    """For the robot and for its class."""
    snapshot = odd.snapshot()
    for who in ("pico_1", "Pico"):
        found = readiness(snapshot, who, "FindEmptyDrink")
        [lack] = found.lacks
        assert found.verdict is Verdict.UNABLE
        assert (lack.kind, lack.what, lack.processes) == (LackKind.CAPABILITY, "RobotWithKinect", ("Kinect",))
        assert lack.text == "it is no RobotWithKinect (hasSensor some Kinect)"
    assert readiness(snapshot, "pico_1", "Navigate").verdict is Verdict.ABLE


def test_why_not_names_what_it_has_instead(odd: KnowledgeBase) -> None:
    """The part of the definition that fails, and what there is."""
    reason = Derivation(odd.snapshot().ontology).capability("pico_1", "RobotWithKinect")
    assert not reason.holds
    [missing] = [r for r in leaves(reason) if not r.holds]
    assert missing.text == "no Kinect by hasSensor; it has a LaserScanner"


def test_why_leads_to_the_lines_of_files(shipped: KnowledgeBase) -> None:
    """From the capability to the class that states the sensor, and the individual that states the class."""
    reason = Derivation(shipped.snapshot().ontology).capability("amigo_1", "RobotWithBase")
    assert all(r.holds for r in leaves(reason))
    texts = {r.text: r.place for r in leaves(reason)}
    for text, entity in (
        ("amigo_1 is a Amigo", "amigo_1"),
        ("every OmnidirectionalBase is a Base", "OmnidirectionalBase"),
    ):
        place = texts[text]
        assert place is not None
        assert f'#{entity}"' in place.file.read_text(encoding="utf-8").splitlines()[place.line - 1]
    lines = list(reason_lines(reason))
    assert any(
        re.search(r"every Amigo hasActuator some OmnidirectionalBase \(amigo\.owl:\d+\)", line) for line in lines
    )


def test_a_battery_that_is_too_small(odd: KnowledgeBase) -> None:
    """1 J at 100 W lasts for 0.01 s; to localize takes 0.019 s."""
    found = readiness(odd.snapshot(), "amigo_1", "Localize")
    [lack] = found.lacks
    assert (found.verdict, lack.kind) == (Verdict.UNABLE, LackKind.BATTERY)
    assert lack.text.endswith("and the battery lasts for 0.01 s")


def test_of_recipes_one_will_do(odd: KnowledgeBase) -> None:
    """A robot without a Kinect looks by laser; it is said by which recipe."""
    found = readiness(odd.snapshot(), "pico_1", "Look")
    assert (found.verdict, found.through, list(found.requires)) == (Verdict.ABLE, ("Laser",), ["RobotWithLaser"])
    assert set(readiness(odd.snapshot(), "amigo_1", "Look").through) == {"Kinect", "Laser"}


def test_a_precondition_that_nothing_fits_is_told(knowledge: KnowledgeBase) -> None:
    """No drink stands where drinks are looked for; a robot of this class could still do it."""
    for drink in ("drink_1", "drink_2"):
        knowledge.tell("locatedAt", drink, "start_west")
    found = readiness(knowledge.snapshot(), "pico_1", "SearchDrink")
    [lack] = found.lacks
    assert (found.verdict, lack.kind) == (Verdict.NOT_NOW, LackKind.CONDITION)
    assert lack.text == "nothing fits locatedAt(drink) = location now"
    assert readiness(knowledge.snapshot(), "Pico", "SearchDrink").verdict is Verdict.ABLE
    knowledge.tell("locatedAt", "drink_1", "at_bar")
    assert readiness(knowledge.snapshot(), "pico_1", "SearchDrink").verdict is Verdict.ABLE


def test_a_robot_whose_place_is_not_known_cannot_travel(folder: Path) -> None:
    """It can still say where it is."""
    instead(SITE, f'<core:locatedAt rdf:resource="{IRI}tue_lab.owl#start_east"/>', "")(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    found = readiness(knowledge.snapshot(), "pico_1", "Navigate")
    assert [lack.kind for lack in found.lacks] == [LackKind.PLACE]
    assert readiness(knowledge.snapshot(), "pico_1", "Localize").verdict is Verdict.ABLE
    knowledge.close()


def test_it_agrees_with_the_planner_rules(odd: KnowledgeBase, shipped: KnowledgeBase) -> None:
    """Without a choice, a robot lacks exactly the capabilities that kb/rules/capability.pl finds missing."""
    for knowledge in (odd, shipped):
        snapshot = knowledge.snapshot()
        for name, process in snapshot.processes.items():
            for robot in ("amigo_1", "pico_1") if process.robots and name != "Look" else ():
                goal = struct(":", "kb_capability", struct("missing", snapshot.revision, name, robot, Var("C")))
                load = struct("use_module", struct("kb_rules", "capability"))
                missing = ask(struct(",", load, struct("findall", Var("C"), goal, Var("Answer"))))
                lacks = readiness(snapshot, robot, name).lacks
                assert sorted(k.what for k in lacks if k.kind is LackKind.CAPABILITY) == sorted(missing), (robot, name)


@pytest.mark.parametrize(("who", "task"), [("pico", "Navigate"), ("RobotWithLaser", "Navigate"), ("pico_1", "Fly")])
def test_unknown_names_are_told(shipped: KnowledgeBase, who: str, task: str) -> None:
    """Robots, classes that are capabilities, and tasks."""
    with pytest.raises(UnknownName):
        readiness(shipped.snapshot(), who, task)


def test_as_data_and_as_a_page(odd: KnowledgeBase) -> None:
    """Both hold verdict, what is missing and why."""
    snapshot = odd.snapshot()
    found = matrix(snapshot, ["pico_1"], ["SearchDrink"])
    [data] = readiness_data(snapshot, found)
    assert (data["verdict"], data["lacks"][0]["what"]) == ("unable", "RobotWithKinect")
    assert {r["capability"] for r in data["requires"]} == {"RobotWithLaser", "RobotWithBase", "RobotWithKinect"}
    page = readiness_page(snapshot, found)
    assert "no Kinect by hasSensor; it has a LaserScanner" in page
    assert '<span class="unable">unable</span>' in page


def test_a_process_that_performs_itself_asks_no_more_the_second_time(shipped: KnowledgeBase, tmp_path: Path) -> None:
    """What it requires is asked once, and the answer comes."""
    beep = Node("Perform", value="Beep")
    program = Program(recipes=(beep,), again=(beep, beep), skilled=frozenset({"Again"}), whole=beep)
    files = read_files(write(graph_of(program), tmp_path), tmp_path)
    ontology = close(files, told(files))
    processes = read_processes(ontology)
    compiler = Compiler(ontology, processes)
    compiler.facts(1)
    snapshot = replace(shipped.snapshot(), ontology=ontology, processes=processes, compiler=compiler)
    assert readiness(snapshot, SKILLED, "Again").verdict is Verdict.ABLE
    lacking = readiness(snapshot, "ann", "Again")
    assert [(lack.what, lack.processes) for lack in lacking.lacks] == [("Skilled", ("Again",))]
