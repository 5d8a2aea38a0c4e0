"""Files are edited while robots work: each edit takes effect as told, or is refused as told, between two actions."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.cli import main
from executive.live import KnowledgeInUse, KnowledgeProposal
from executive.replay import first_difference
from executive.trace import (
    ActionFinished,
    FactsTold,
    KnowledgeAccepted,
    KnowledgeProposed,
    KnowledgeRefused,
    KnowledgeRolledBack,
    PlanMade,
    Replanned,
    TaskCarriedOver,
    TaskStatusChanged,
    TraceEvent,
)
from kb.errors import ConcertmasterError
from kb.files import SHIPPED
from kb.problems import OntologyRejected
from kb.store import ProposalOutdated, UnknownRevision
from tests.scenarios.conftest import NO_KINECT, Edit
from tests.scenarios.test_faults import finished, scenario_with

IRI = "http://example.org/concertmaster/"
SITE = "sites/tue_lab/tue_lab.owl"
TASK = "tasks/find_empty_drink.owl"
AT_BAR = (f'{IRI}tue_lab.owl#at_dining_table"/>', f'{IRI}tue_lab.owl#at_bar"/>')
NEW_TASK = f"""    <owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#Tidy">
        <rdf:type rdf:resource="{IRI}core.owl#CompositeProcess"/>
        <core:composedOf rdf:resource="{IRI}tue_lab.owl#Tidy_10_Find"/>
        <core:hasInput rdf:resource="{IRI}tue_lab.owl#Tidy_room"/>
        <core:keepsRobot rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">false</core:keepsRobot>
        <rdfs:comment xml:lang="en">Looks for empty drinks.</rdfs:comment>
        <rdfs:label xml:lang="en">tidy</rdfs:label>
    </owl:NamedIndividual>
    <owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#Tidy_room">
        <rdf:type rdf:resource="{IRI}core.owl#Input"/>
        <core:parameterName rdf:datatype="http://www.w3.org/2001/XMLSchema#string">room</core:parameterName>
        <core:parameterNumber rdf:datatype="http://www.w3.org/2001/XMLSchema#integer">1</core:parameterNumber>
        <core:parameterType rdf:resource="{IRI}core.owl#Area"/>
        <rdfs:label xml:lang="en">room of tidy</rdfs:label>
    </owl:NamedIndividual>
    <owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#Tidy_10_Find">
        <rdf:type rdf:resource="{IRI}core.owl#Perform"/>
        <core:performs rdf:resource="{IRI}find_empty_drink.owl#FindEmptyDrink"/>
        <rdfs:label xml:lang="en">find</rdfs:label>
    </owl:NamedIndividual>
</rdf:RDF>"""


def kinds(events: list[TraceEvent], kind: type[TraceEvent]) -> list[TraceEvent]:
    """The events of one kind."""
    return [event for event in events if isinstance(event, kind)]


def moved_drink(knowledge: Path, edit: Edit) -> None:
    """The file says that drink_2 is at the bar."""
    text = (knowledge / SITE).read_text(encoding="utf-8")
    start = text.index(f'about="{IRI}tue_lab.owl#drink_2"')
    end = text.index("</owl:NamedIndividual>", start)
    block = text[start:end]
    assert block.count(AT_BAR[0]) == 1
    (knowledge / SITE).write_text(text[:start] + block.replace(*AT_BAR) + text[end:], encoding="utf-8")


def test_a_drink_moved_in_the_file_is_looked_for_there(tmp_path: Path, knowledge: Path, edit: Edit) -> None:
    """Pico is on its way to where it was; the plan for the rest is another one, and so is that of the queued task."""
    scenario = scenario_with(tmp_path, "position = [8.3, 5.6, 0.75]", "position = [7.5, 2.6, 1.0]")
    with Fleet.open("tue_lab", scenario=scenario, knowledge=knowledge) as fleet:
        task, queued = (fleet.request("FindEmptyDrink", room=room) for room in ("tue_lab", "kitchen"))
        task.wait_until(3.0)
        before = len(fleet.trace)
        moved_drink(knowledge, edit)
        proposal = fleet.propose_knowledge()
        assert proposal.difference.summary == "1 individual changed"
        assert [e.task for e in proposal.effects] == [task.name, queued.name]
        assert 'pico_1 does Navigate(pico_1,"tue_lab","at_bar")' in proposal.effects[0].text
        assert all(e.before.makespan_s != e.after.makespan_s for e in proposal.effects)
        fleet.accept_knowledge(proposal)
        assert task.wait().status is TaskStatus.COMPLETED
        assert queued.wait().status is TaskStatus.COMPLETED
        after = list(fleet.trace)[before:]
        assert [type(e) for e in after[:4]] == [KnowledgeProposed, KnowledgeAccepted, FactsTold, TaskCarriedOver]
        [told] = [e for e in after if isinstance(e, FactsTold) and e.source == "files"]
        assert (told.task, told.prop, told.subject, told.value) == ("", "locatedAt", "drink_2", "at_bar")
        [over] = [e for e in after if isinstance(e, TaskCarriedOver)]
        assert (over.task, over.revision) == (task.name, 2)
        anew = next(e for e in after if isinstance(e, Replanned))
        assert "revision 2 of the knowledge: locatedAt(drink_2) has another value" in anew.reason
        looked = {(e.robot, e.action.split('"')[1]) for e in finished(fleet, "Detection")}
        assert ("pico_1", "drink_2") in looked
        [change] = fleet.history("locatedAt", "drink_2")
        assert (change.before, change.value, str(change.source)) == (
            "at_dining_table",
            "at_bar",
            "stated in files, revision 2",
        )
        assert fleet.known_at(2.9)["locatedAt", "drink_2"] == "at_dining_table"
        assert fleet.known_at(3.1)["locatedAt", "drink_2"] == "at_bar"


def test_what_was_told_holds_against_the_file_and_a_replay_does_the_same(
    knowledge: Path, tmp_path: Path, edit: Edit
) -> None:
    """The person who saw the drink knows better than the file, which says where things begin; that is said."""
    original = tmp_path / "original"
    shutil.copytree(knowledge, original)
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task = fleet.request("FindEmptyDrink", room="living_room")
        task.wait_until(1.0)
        fleet.tell("locatedAt", "drink_2", "at_cabinet")
        moved_drink(knowledge, edit)
        proposal = fleet.propose_knowledge()
        assert "locatedAt(drink_2) stays at_cabinet, as told; the files now begin with at_bar" in proposal.text
        fleet.accept_knowledge(proposal)
        assert fleet.parts.knowledge.snapshot().value("locatedAt", "drink_2") == "at_cabinet"
        task.wait_until(2.0)
        fleet.roll_back_knowledge(1)
        task.wait_until(3.0)
        task.cancel()
        recorded = list(fleet.trace)
    assert len(kinds(recorded, KnowledgeRolledBack)) == 1
    assert first_difference(recorded, original) == ""


def test_a_class_that_loses_its_camera_is_replaced(knowledge: Path, edit: Edit) -> None:
    """Amigo is on its way; what it does now ends as it began, then Pico gets its drink too."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task = fleet.request("FindEmptyDrink", room="tue_lab")
        task.wait_until(2.0)
        edit(knowledge / "robots" / "amigo.owl", NO_KINECT, "")
        proposal = fleet.propose_knowledge()
        [loss] = proposal.difference.capabilities
        assert (loss.robot, loss.gained) == ("amigo_1", ())
        [effect] = proposal.effects
        assert {robot for robot, _ in effect.after.steps} == {"pico_1"}
        before = len(fleet.trace)
        fleet.accept_knowledge(proposal)
        assert task.wait().status is TaskStatus.COMPLETED, task.wait().reason
        assert {e.robot for e in finished(fleet, "Detection")} == {"pico_1"}
        anew = next(e for e in fleet.trace[before:] if isinstance(e, Replanned))
        assert "(amigo_1) has ended, and its robot is no longer capable of what it was to do next" in anew.reason
        numbers = [e.number for e in fleet.trace if isinstance(e, ActionFinished)]
        assert len(set(numbers)) == len(numbers)
        assert {e.outcome for e in fleet.trace if isinstance(e, ActionFinished)} == {"SUCCEEDED"}


def test_a_new_task_type_can_be_asked_for(knowledge: Path, edit: Edit) -> None:
    """While a task is underway, which goes on without a new plan: nothing that it rests on has changed."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task = fleet.request("FindEmptyDrink", room="kitchen")
        task.wait_until(2.0)
        edit(knowledge / SITE, "</rdf:RDF>", NEW_TASK)
        proposal = fleet.propose_knowledge()
        assert proposal.difference.tasks_added == ("Tidy",)
        assert [e.before == e.after for e in proposal.effects] == [True]
        fleet.accept_knowledge(proposal)
        tidy = fleet.request("Tidy", room="living_room")
        assert (task.wait().status, tidy.wait().status) == (TaskStatus.COMPLETED, TaskStatus.COMPLETED)
        assert not kinds(list(fleet.trace), Replanned)
        assert len(kinds(list(fleet.trace), PlanMade)) == 2


def test_a_task_whose_program_changes_finishes_as_it_began(knowledge: Path, edit: Edit) -> None:
    """The trace says so; the queued one has the new program."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task, queued = (fleet.request("FindEmptyDrink", room=room) for room in ("kitchen", "living_room"))
        task.wait_until(2.0)
        text = (knowledge / TASK).read_text(encoding="utf-8")
        start = text.index(f'<owl:NamedIndividual rdf:about="{IRI}find_empty_drink.owl#FindEachDrink_is_empty"')
        end = text.index("</owl:NamedIndividual>", start)
        block = text[start:end].replace(">true<", ">false<")  # from now on, for drinks that are not empty
        (knowledge / TASK).write_text(text[:start] + block + text[end:], encoding="utf-8")
        proposal = fleet.propose_knowledge()
        assert [p.process for p in proposal.difference.processes if p.program] == ["FindEachDrink"]
        assert proposal.effects[0].before == proposal.effects[0].after
        fleet.accept_knowledge(proposal)
        assert task.wait().status is TaskStatus.COMPLETED
        [kept] = [e for e in fleet.trace if isinstance(e, TaskCarriedOver)]
        assert (kept.task, kept.revision) == (task.name, 1)
        assert kept.reason == "the program of FindEachDrink is another one in revision 2"
        assert queued.wait().status is TaskStatus.COMPLETED
        detected = [e.action for e in finished(fleet, "Detection")]
        assert len(detected) == 1  # no drink in the living room is full


def test_what_a_task_uses_cannot_be_removed(knowledge: Path, edit: Edit) -> None:
    """A robot that is at work stays in the knowledge; once it is not, it may go."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task = fleet.request("FindEmptyDrink", room="kitchen")
        task.wait_until(2.0)
        text = (knowledge / SITE).read_text(encoding="utf-8")
        start = text.index(f'    <owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#pico_1"')
        end = text.index("</owl:NamedIndividual>", start) + len("</owl:NamedIndividual>")
        (knowledge / SITE).write_text(text[:start] + text[end:], encoding="utf-8")
        proposal = fleet.propose_knowledge()
        with pytest.raises(KnowledgeInUse, match="revision 2 does not know pico_1, used by FindEmptyDrink-1"):
            fleet.accept_knowledge(proposal)
        assert fleet.parts.knowledge.revision.number == 1
        assert task.wait().status is TaskStatus.COMPLETED
        fleet.accept_knowledge(fleet.propose_knowledge())
        assert fleet.parts.knowledge.snapshot().ontology.individuals("Robot") == ["amigo_1"]
        [refused] = [e for e in fleet.trace if isinstance(e, KnowledgeRefused)]
        assert refused.revision == 2


def test_a_queued_task_that_makes_no_sense_any_more_is_refused(knowledge: Path, edit: Edit) -> None:
    """Its room was renamed; before it is accepted, that is told."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task = fleet.request("FindEmptyDrink", room="kitchen")
        queued = fleet.request("FindEmptyDrink", room="living_room")
        task.wait_until(1.0)
        for file in (knowledge / "sites").rglob("*.owl"):
            text = file.read_text(encoding="utf-8")
            file.write_text(text.replace("#living_room", "#salon"), encoding="utf-8")
        proposal = fleet.propose_knowledge()
        assert "refused" in proposal.effects[1].text
        fleet.accept_knowledge(proposal)
        result = queued.wait()
        assert result.status is TaskStatus.REFUSED
        assert "room='living_room' of FindEmptyDrink is not known" in result.reason
        assert task.wait().status is TaskStatus.COMPLETED


def test_wrong_files_change_nothing(knowledge: Path, edit: Edit) -> None:
    """File, line, entity and code are told; the revision in force goes on, and the task with it."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        task = fleet.request("FindEmptyDrink", room="kitchen")
        task.wait_until(2.0)
        edit(knowledge / "tasks" / "groundings.owl", ">/compute/vel_cmd<", ">/compute/vel_cmdx<")
        with pytest.raises(ConcertmasterError, match="there is no /compute/vel_cmdx"):
            fleet.propose_knowledge()
        edit(knowledge / "tasks" / "groundings.owl", ">/compute/vel_cmdx<", ">/compute/vel_cmd<")
        edit(knowledge / SITE, f'<core:locatedAt rdf:resource="{IRI}tue_lab.owl#start_west"/>', "<core:locatedAd/>")
        with pytest.raises(OntologyRejected) as rejected:
            fleet.propose_knowledge()
        [problem, *_] = rejected.value.problems
        assert (problem.code, problem.file, problem.entity) == ("KB011", knowledge / SITE, "amigo_1")
        assert problem.line > 0
        assert fleet.parts.knowledge.revision.number == 1
        assert task.wait().status is TaskStatus.COMPLETED
        assert [e.revision for e in fleet.trace if isinstance(e, KnowledgeRefused)] == [0, 0]
        assert not [e for e in fleet.trace if isinstance(e, TaskStatusChanged) and e.status == "failed"]


def test_a_robot_that_is_not_in_the_fleet(knowledge: Path, edit: Edit) -> None:
    """The files may not have it: a simulated fleet keeps its robots; the message tells what would be right."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        text = (knowledge / SITE).read_text(encoding="utf-8")
        start = text.index(f'    <owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#pico_1"')
        end = text.index("</owl:NamedIndividual>", start) + len("</owl:NamedIndividual>")
        another = text[start:end].replace("pico_1", "pico_2").replace("start_east", "at_bar")
        (knowledge / SITE).write_text(text[:end] + another + text[end:], encoding="utf-8")
        told = "pico_2 is in the files but not in this fleet, .*: amigo_1, pico_1; open a fleet with a scenario"
        with pytest.raises(ConcertmasterError, match=told):
            fleet.propose_knowledge()
        assert fleet.parts.knowledge.proposal is None


def test_one_proposal_at_a_time(knowledge: Path, edit: Edit) -> None:
    """An older one cannot be accepted, nor one that is in force, nor a revision that never was."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        old, new = fleet.propose_knowledge(), fleet.propose_knowledge(SHIPPED)
        with pytest.raises(ProposalOutdated, match="revision 2 is not proposed any more"):
            fleet.accept_knowledge(old)
        fleet.accept_knowledge(new)
        with pytest.raises(ProposalOutdated):
            fleet.accept_knowledge(new)
        with pytest.raises(UnknownRevision, match="no revision 7 to go back to; there is 1"):
            fleet.roll_back_knowledge(7)


def test_a_replay_without_the_files_of_then_says_why(knowledge: Path, edit: Edit, tmp_path: Path) -> None:
    """The folder was edited once more: its hash is another one."""
    with Fleet.open("tue_lab", knowledge=SHIPPED) as fleet:
        moved_drink(knowledge, edit)
        fleet.accept_knowledge(fleet.propose_knowledge(knowledge))
        recorded = list(fleet.trace)
    edit(knowledge / "robots" / "pico.owl", ">0.6<", ">1.2<")
    with pytest.raises(ConcertmasterError, match="cannot be repeated: revision 2 was read from"):
        first_difference(recorded, SHIPPED)


def test_what_was_saved_before_the_watch_began(knowledge: Path, edit: Edit) -> None:
    """Since the fleet was opened: it comes into force as well."""
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        edit(knowledge / SITE, "</rdf:RDF>", NEW_TASK)
        fleet.watch_knowledge()
        assert fleet.parts.live.found.wait(5.0)
        fleet.let_time_pass(1.0)
        assert fleet.parts.knowledge.revision.number == 2


@pytest.mark.slow
def test_a_watched_folder(knowledge: Path, edit: Edit, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is saved comes into force within five seconds; what is wrong is told by file, line, entity and code.

    The run can be replayed though the folder is not as it was, neither at the beginning nor later.
    """
    changes: list[object] = []
    edit(knowledge / "robots" / "pico.owl", ">0.6<", ">0.5<")
    with Fleet.open("tue_lab", knowledge=knowledge, trace=tmp_path / "run" / "trace.jsonl") as fleet:
        found = fleet.parts.live.found
        fleet.watch_knowledge(on_change=changes.append)
        task = fleet.request("FindEmptyDrink", room="kitchen")
        task.wait_until(1.0)
        edit(knowledge / SITE, f'<core:locatedAt rdf:resource="{IRI}tue_lab.owl#start_west"/>', "<core:locatedAd/>")
        assert found.wait(5.0)
        task.wait_until(1.5)
        [wrong] = changes
        assert isinstance(wrong, OntologyRejected)
        assert str(knowledge / SITE) in str(wrong)
        assert "KB011" in str(wrong)
        assert fleet.parts.knowledge.revision.number == 1
        edit(knowledge / SITE, "<core:locatedAd/>", f'<core:locatedAt rdf:resource="{IRI}tue_lab.owl#start_west"/>')
        assert found.wait(5.0)
        task.wait_until(2.0)
        assert len(changes) == 1  # the files are those in force again
        edit(knowledge / SITE, "</rdf:RDF>", NEW_TASK)
        assert found.wait(5.0)
        task.wait_until(2.5)
        assert isinstance(changes[-1], KnowledgeProposal)
        assert fleet.parts.knowledge.revision.number == 2
        assert fleet.request("Tidy", room="living_room").name == "Tidy-1"
        assert task.wait().status is TaskStatus.COMPLETED
        kept = {e.revision: e.knowledge for e in fleet.trace if isinstance(e, KnowledgeAccepted)}
        first = fleet.parts.knowledge.revisions[0].digest
    edit(knowledge / "robots" / "pico.owl", ">0.5<", ">0.4<")
    assert {p.name for p in (tmp_path / "run" / "knowledge").iterdir()} == {first, kept[2]}
    assert main(["trace", str(tmp_path / "run" / "trace.jsonl"), "--replay"]) == 0
    assert "all the same" in capsys.readouterr().out
