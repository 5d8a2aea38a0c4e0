"""Another revision of the knowledge, as the loop sees it: who goes over, who stays, what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from executive import events, trace
from executive.cli import main
from executive.events import AdoptKnowledge, NewKnowledge, RebaseTask
from executive.kb_commands.history import history_of
from executive.loop import step
from executive.state import State
from kb.files import SHIPPED
from planner.progress import Ended, Progress, Started, Told
from tests.executive.made import action, after, others, planned, ready, recorded, requested

SWEEP = action("Sweep", "r1")


def new(
    *,
    removed: frozenset[str] = frozenset(),
    keeping: Mapping[str, str] | None = None,
    unfit: Mapping[str, str] | None = None,
    earlier: bool = False,
) -> NewKnowledge:
    """Revision 2."""
    return NewKnowledge(
        revision=2,
        digest="abc",
        folder="next",
        summary="1 individual changed",
        changes=("a.owl: individual attic changed",),
        earlier=earlier,
        removed=removed,
        keeping=keeping or {},
        unfit=unfit or {},
    )


def at_work() -> State:
    """One task is underway with a robot that sweeps, two are queued."""
    state, _ = after(
        requested("one"),
        events.KnowledgeWasRead(task="one", facts_told=0, revision=1),
        planned("one"),
        ready("one", Started(action=SWEEP)),
        requested("two"),
        requested("three"),
    )
    return state


def test_a_proposal_is_told_and_changes_nothing() -> None:
    """With what is different, and which queued tasks would be refused."""
    state = at_work()
    again, commands = step(state, events.KnowledgeWasProposed(knowledge=new(unfit={"two": "no attic"})), 5.0)
    assert again == state
    [told] = recorded(commands)
    assert told == trace.KnowledgeProposed(
        t_s=5.0,
        revision=2,
        knowledge="abc",
        folder="next",
        changes=["a.owl: individual attic changed", "two would be refused: no attic"],
    )


def test_wrong_files_are_told() -> None:
    """Nothing else comes of them."""
    state = at_work()
    again, commands = step(state, events.KnowledgeWasRejected(folder="next", reason="a.owl:1 KB001"), 5.0)
    assert (again, others(commands)) == (state, [])
    assert recorded(commands) == [trace.KnowledgeRefused(t_s=5.0, revision=0, folder="next", reason="a.owl:1 KB001")]


def test_the_task_underway_goes_over_and_its_action_goes_on() -> None:
    """First the revision comes into force, then the task is rebased; leases stay as they are."""
    before = at_work()
    state, commands = step(before, events.KnowledgeWasAccepted(knowledge=new()), 5.0)
    assert others(commands) == [AdoptKnowledge(revision=2), RebaseTask(task="one")]
    assert [type(e) for e in recorded(commands)] == [trace.KnowledgeAccepted, trace.TaskCarriedOver]
    assert (state.running, state.leases) == (before.running, before.leases)
    assert [t.revision for t in state.tasks.values()] == [2, 0, 0]


def test_a_task_whose_program_is_another_one_stays() -> None:
    """The trace says under which revision, and why."""
    accepted = events.KnowledgeWasAccepted(knowledge=new(keeping={"one": "it is another program"}))
    state, commands = step(at_work(), accepted, 5.0)
    assert others(commands) == [AdoptKnowledge(revision=2)]
    *_, kept = recorded(commands)
    assert kept == trace.TaskCarriedOver(t_s=5.0, task="one", revision=1, reason="it is another program")
    assert state.tasks["one"].revision == 1


def test_a_queued_task_that_makes_no_sense_is_refused() -> None:
    """The others wait on."""
    state, commands = step(at_work(), events.KnowledgeWasAccepted(knowledge=new(unfit={"two": "no attic"})), 5.0)
    assert list(state.tasks) == ["one", "three"]
    [ended] = [c for c in commands if isinstance(c, events.FinishTask)]
    assert (ended.task, ended.status, ended.reason) == ("two", events.TaskStatus.REFUSED, "no attic")


@pytest.mark.parametrize("gone", ["r1", "attic"])
def test_what_the_task_underway_uses_must_stay(gone: str) -> None:
    """A robot at work, or an argument of the task; then nothing changes."""
    state = at_work()
    again, commands = step(state, events.KnowledgeWasAccepted(knowledge=new(removed=frozenset({gone, "r7"}))), 5.0)
    assert (again, others(commands)) == (state, [])
    [refused] = recorded(commands)
    assert isinstance(refused, trace.KnowledgeRefused)
    assert refused.revision == 2
    assert f"does not know {gone}, used by one" in refused.reason


def test_an_earlier_revision_comes_into_force_again() -> None:
    """The same, by another name; without tasks, it is only put in force."""
    state, commands = step(State(), events.KnowledgeWasAccepted(knowledge=new(earlier=True)), 5.0)
    assert state == State()
    assert others(commands) == [AdoptKnowledge(revision=2)]
    [back] = recorded(commands)
    assert isinstance(back, trace.KnowledgeRolledBack)


def test_facts_know_whose_effects_they_are() -> None:
    """The first ones are effects of the action that succeeded, the others of the process that ends next."""
    state, _ = after(requested("one"), planned("one"))
    inner, outer = action("Mop", "r1"), action("Tidy", "r1")
    own, his, its = (Told(prop="isClean", subject=s, value=True) for s in ("floor", "room", "attic"))
    progress = Progress(
        events=(own, his, Ended(action=inner), its, Ended(action=outer)), done=False, running=1, replan=False, own=1
    )
    _, commands = step(state, events.ActionsAreReady(task="one", progress=progress, cause=SWEEP), 5.0)
    told = {c.subject: c.source for c in others(commands) if isinstance(c, events.Tell)}
    assert told == {"floor": SWEEP, "room": inner, "attic": outer}


def test_the_history_of_a_trace() -> None:
    """Facts with their sources; those of files know their revision, and what was so before is that in the trace."""
    told: list[trace.TraceEvent] = [
        trace.FactsTold(t_s=1.0, task="one", prop="at", subject="r1", value="bar", source="Go(r1)", robot="r1"),
        trace.KnowledgeAccepted(t_s=2.0, revision=2, knowledge="abc", reason=""),
        trace.FactsTold(t_s=2.0, task="", prop="at", subject="cup", value="sink", source="files"),
        trace.FactsTold(t_s=3.0, task="", prop="at", subject="r1", value="sink", source="person"),
        trace.FactsTold(t_s=4.0, task="", prop="at", subject="cup", value=None),
    ]
    history = history_of(told)
    assert [str(f) for f in history.of()] == [
        "1.000 s  at(r1): not known -> bar  (effect of Go(r1) of one)",
        "2.000 s  at(cup): not known -> sink  (stated in files, revision 2)",
        "3.000 s  at(r1): bar -> sink  (told by a person)",
        "4.000 s  at(cup): sink -> not known  (told by a person)",
    ]
    assert history.known_at(2.5) == {("at", "r1"): "bar", ("at", "cup"): "sink"}


def test_the_command_tells_the_history_of_a_run(trace_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All facts, those of an individual, and what was known at a time."""
    assert main(["kb", "history", str(trace_file)]) == 0
    everything = capsys.readouterr().out.splitlines()
    assert main(["kb", "history", str(trace_file), "hasPoseEstimate", "amigo_1", "--at", "1000"]) == 0
    [known] = capsys.readouterr().out.splitlines()
    assert known.startswith("hasPoseEstimate(amigo_1) = [")
    assert any("(effect of " in line for line in everything)


def test_the_command_tells_what_is_different(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By file and value, and for a task that exists in one folder alone; nothing, of the same folder."""
    site = knowledge / "sites" / "tue_lab" / "tue_lab.owl"
    shipped = str(SHIPPED)
    assert main(["kb", "diff", shipped, str(knowledge)]) == 0
    assert capsys.readouterr().out == "nothing is different\n"
    site.write_text(site.read_text(encoding="utf-8").replace("#kitchen", "#galley"), encoding="utf-8")
    tasks = ["--task", "FindEmptyDrink room=galley", "--task", "FindEmptyDrink room=kitchen"]
    assert main(["kb", "diff", shipped, str(knowledge), *tasks]) == 0
    told = capsys.readouterr().out
    assert "sites/tue_lab/tue_lab.owl: individual kitchen removed" in told
    galley, kitchen = told.splitlines()[-2:]
    assert "refused (" in galley.split("before, ")[0]
    assert "refused (" in kitchen.split("before, ")[1]
    assert main(["kb", "diff", shipped, str(knowledge), "--task", "FindEmptyDrink kitchen"]) == 2
    assert "'kitchen' is no argument; write name=value" in capsys.readouterr().err
