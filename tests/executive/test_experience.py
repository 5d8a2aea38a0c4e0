"""From traces to tries and trips."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from executive import Fleet
from executive.cli import main
from executive.experience import gather
from executive.trace import (
    ActionFinished,
    FactsTold,
    FleetOpened,
    KnowledgeAccepted,
    PlanMade,
    ProcessBegun,
    ProcessEnded,
    RecoveryChosen,
    TaskFinished,
    TraceEvent,
    to_json,
)
from kb.experience import Experience, Tries, Trip
from kb.learned import Refinement, main_file, site_file, write_learned
from kb.store import Snapshot, load
from kb.vocabulary import Property

NAVIGATE = 'Navigate(amigo_1,"kitchen","at_bar")'


def planned(*steps: tuple[str, float, float]) -> PlanMade:
    """A plan of these steps."""
    return PlanMade(
        t_s=0.5,
        task="one",
        status="SOLVED_OPTIMALLY",
        makespan_s=9.0,
        lower_bound_s=9.0,
        steps=[(action, "amigo_1", start_s, end_s) for action, start_s, end_s in steps],
        reason="",
    )


def begun(t_s: float) -> ProcessBegun:
    """The robot begins to drive."""
    return ProcessBegun(t_s=t_s, task="one", process=NAVIGATE, robot="amigo_1")


def ended(t_s: float) -> ProcessEnded:
    """The robot has arrived."""
    return ProcessEnded(t_s=t_s, task="one", process=NAVIGATE, robot="amigo_1")


def finished(
    t_s: float, action: str, outcome: str = "SUCCEEDED", *, elapsed_s: float = 0.02, planned_s: float = 0.02
) -> ActionFinished:
    """An action of the robot has ended."""
    return ActionFinished(
        t_s=t_s,
        task="one",
        action=action,
        robot="amigo_1",
        number=1,
        outcome=outcome,
        failure="" if outcome == "SUCCEEDED" else "NoPath",
        reason="",
        planned_s=planned_s,
        elapsed_s=elapsed_s,
        outputs={},
    )


def recovery(t_s: float, chosen: str = "", number: int = 2) -> RecoveryChosen:
    """What is done about an action of the robot that has failed."""
    return RecoveryChosen(
        t_s=t_s,
        task="one",
        action="Base(amigo_1)",
        robot="amigo_1",
        number=number,
        failure="UnknownFailure",
        recovery=chosen,
        reason="",
    )


def tries(process: str, ms: int, *, place: str = "", succeeded: bool = True, count: int = 1) -> Tries:
    """Tries of the robot."""
    return Tries(process=process, robot="amigo_1", place=place, took_ms=ms, succeeded=succeeded, count=count)


def test_a_trip_is_what_the_plan_estimated_and_what_it_took(snapshot: Snapshot) -> None:
    """Of 6 s planned, 1.5 s are stated to come on top of the way; of two such steps, the nearer one counts."""
    events: list[TraceEvent] = [
        planned((NAVIGATE, 0.5, 6.5), (NAVIGATE, 20.0, 21.5)),
        begun(0.6),
        finished(0.62, 'NavMap(amigo_1,"kitchen")'),
        finished(0.64, 'NavMap(amigo_1,"kitchen")'),
        ended(7.6),
        begun(19.0),
        ended(21.0),
    ]
    gathered = gather(events, snapshot.ontology, same_knowledge=True)
    assert gathered.trips == (
        Trip(process="Navigate", robot="amigo_1", place="at_bar", way_ms=4500, took_ms=7000),
        Trip(process="Navigate", robot="amigo_1", place="at_bar", way_ms=0, took_ms=2000),
    )
    assert gathered.tries == (
        tries("NavMap", 20, count=2),
        tries("Navigate", 2000, place="at_bar"),
        tries("Navigate", 7000, place="at_bar"),
    )
    without = gather(events, snapshot.ontology, same_knowledge=False)
    assert (without.tries, without.trips) == (gathered.tries, ())


@pytest.mark.parametrize("outcome", ["EXECUTION_FAILED", "POSTCONDITION_FAILED", "TIMED_OUT"])
def test_what_fails_fails_the_process_around_it(outcome: str, snapshot: Snapshot) -> None:
    """Both are tries that took their time; that the process ends later counts no more."""
    events: list[TraceEvent] = [
        planned((NAVIGATE, 0.5, 6.5)),
        begun(0.5),
        finished(2.5, "Base(amigo_1)", outcome),
        recovery(2.5),
        ended(9.0),
    ]
    gathered = gather(events, snapshot.ontology, same_knowledge=True)
    assert gathered.tries == (
        tries("Base", 20, succeeded=False),
        tries("Navigate", 2000, place="at_bar", succeeded=False),
    )
    assert gathered.trips == ()


def test_a_recovery_is_a_try_that_helps_or_not(snapshot: Snapshot) -> None:
    """The process around what is tried again has not failed by that."""
    events: list[TraceEvent] = [
        planned((NAVIGATE, 0.5, 6.5)),
        begun(0.5),
        finished(2.5, "Base(amigo_1)", "TIMED_OUT"),
        recovery(2.5, "retry", number=1),
        finished(3.0, "Base(amigo_1)", "TIMED_OUT", elapsed_s=0.5),
        recovery(3.0, "retry", number=1),
        finished(3.5, "Base(amigo_1)", elapsed_s=0.5),
        ended(9.0),
    ]
    gathered = gather(events, snapshot.ontology, same_knowledge=False)
    assert [(t.process, t.succeeded) for t in gathered.tries if t.process in ("retry", "Navigate")] == [
        ("Navigate", True),
        ("retry", False),
        ("retry", True),
    ]


def test_a_recovery_that_begins_a_process_again_helps_if_the_process_ends(snapshot: Snapshot) -> None:
    """It has not helped if the process is begun again once more, or left; both times the process itself has failed."""
    again = replace(recovery(2.5, "start_over"), again=NAVIGATE)
    events: list[TraceEvent] = [
        begun(0.5),
        again,
        begun(3.0),
        finished(4.0, "Base(amigo_1)", "TIMED_OUT"),
        recovery(4.0, "retry"),
        finished(4.5, "Base(amigo_1)"),
        replace(again, t_s=5.0),
        begun(5.5),
        ended(9.0),
        begun(10.0),
        replace(again, t_s=12.0),
        begun(12.5),
        recovery(13.0),
    ]
    gathered = gather(events, snapshot.ontology, same_knowledge=False)
    told = [(t.process, t.took_ms, t.succeeded) for t in gathered.tries if t.process in ("start_over", "Navigate")]
    assert told == [
        ("Navigate", 500, False),
        ("Navigate", 2000, False),
        ("Navigate", 3500, True),
        ("start_over", 1000, False),
        ("start_over", 2500, False),
        ("start_over", 4000, True),
    ]


def test_what_was_not_tried_does_not_count(snapshot: Snapshot) -> None:
    """A call that was not made, a process given up before its next action, one that was underway at the end."""
    over = TaskFinished(t_s=3.0, task="one", status="canceled", reason="", took_s=3.0, outputs={})
    events: list[TraceEvent] = [
        finished(1.0, "Base(amigo_1)", "REFUSED", elapsed_s=0.0),
        finished(1.0, "Base(amigo_1)", "TIMED_OUT", elapsed_s=0.0, planned_s=0.0),
        begun(2.0),
        over,
        ended(4.0),
    ]
    assert gather(events, snapshot.ontology, same_knowledge=True).tries == ()


def test_what_is_stated_to_take_no_time_is_learned_of_too(snapshot: Snapshot) -> None:
    """It was tried all the same, and took its time."""
    events: list[TraceEvent] = [
        finished(1.0, "Base(amigo_1)", planned_s=0.0),
        finished(2.0, "Base(amigo_1)", "TIMED_OUT", elapsed_s=1.0, planned_s=0.0),
    ]
    got = gather(events, snapshot.ontology, same_knowledge=True).tries
    assert [(t.took_ms, t.succeeded) for t in got] == [(20, True), (1000, False)]


def test_a_try_is_where_its_robot_is(snapshot: Snapshot) -> None:
    """Where it starts, as the ontology says; nowhere on the way; where it has come to; what it names comes first."""
    arrived = FactsTold(t_s=7.0, task="one", prop="locatedAt", subject="amigo_1", value="at_bar")
    events: list[TraceEvent] = [
        finished(0.3, "Kinect(amigo_1)"),
        planned((NAVIGATE, 0.5, 6.5)),
        begun(0.5),
        finished(2.0, "Base(amigo_1)"),
        ended(7.0),
        arrived,
        finished(8.0, "Kinect(amigo_1)"),
        finished(9.0, 'Path(amigo_1,"at_cabinet")'),
        FactsTold(t_s=10.0, task="", prop="locatedAt", subject="amigo_1", value=None),
        finished(11.0, "Laser(amigo_1)"),
    ]
    places = {(t.process, t.place) for t in gather(events, snapshot.ontology, same_knowledge=True).tries}
    assert places == {
        ("Kinect", "start_west"),
        ("Navigate", "at_bar"),
        ("Base", ""),
        ("Kinect", "at_bar"),
        ("Path", "at_cabinet"),
        ("Laser", ""),
    }


def test_the_way_of_a_trip_is_worked_out_with_what_was_learned(knowledge: Path) -> None:
    """6 s are planned for it: of amigo_1 at the bar, 2 s come on top, and the odds are a half."""
    site, core = "http://example.org/concertmaster/tue_lab.owl#", "http://example.org/concertmaster/navigation.owl#"
    there = [
        Refinement(prop=p, subject=f"{core}Navigate", value=v, source="", robot=f"{site}amigo_1", place=f"{site}at_bar")
        for p, v in ((Property.DURATION_S, 2.0), (Property.SUCCESS_ODDS, 0.5))
    ]
    write_learned(knowledge, "tue_lab", there)
    learned = load(main_file(knowledge, "tue_lab"), knowledge)
    events: list[TraceEvent] = [planned((NAVIGATE, 0.5, 6.5)), begun(0.5), ended(7.5)]
    [trip] = gather(events, learned, same_knowledge=True).trips
    assert trip.way_ms == 1000


@pytest.mark.slow
def test_a_run_tells_a_trip(snapshot: Snapshot) -> None:
    """A robot has driven; tries are as many as actions, and the trip took about what was estimated."""
    with Fleet.open("tue_lab") as fleet:
        fleet.request("Navigate", robot="amigo_1", area="kitchen", location="at_bar").wait()
        events = list(fleet.trace)
    gathered = gather(events, snapshot.ontology, same_knowledge=True)
    [trip] = gathered.trips
    assert (trip.process, trip.robot, trip.place) == ("Navigate", "amigo_1", "at_bar")
    assert 0.5 < trip.took_ms / (trip.way_ms + 1500) < 2
    actions = [e for e in events if isinstance(e, ActionFinished)]
    assert sum(t.count for t in gathered.tries if t.process != "Navigate") == len(actions)


def test_a_change_of_the_knowledge_ends_the_trips(snapshot: Snapshot) -> None:
    """What plans estimate may come from other durations then."""
    accepted = KnowledgeAccepted(t_s=5.0, revision=2, knowledge="", reason="")
    plan = planned((NAVIGATE, 0.5, 6.5), (NAVIGATE, 20.0, 26.0))
    events: list[TraceEvent] = [plan, begun(0.6), ended(5.0), accepted, begun(20.0), ended(21.0)]
    assert [t.took_ms for t in gather(events, snapshot.ontology, same_knowledge=True).trips] == [4400]


# The command


@pytest.fixture
def five_trips(tmp_path: Path, knowledge: Path) -> list[str]:
    """Options for a trace of five trips that took a second longer than planned, and its knowledge."""
    digest = load(site_file(knowledge, "tue_lab"), knowledge).files.digest
    events: list[TraceEvent] = [
        FleetOpened(t_s=0.0, site="tue_lab", robots=["amigo_1"], knowledge=digest, scenario="tue_lab", seed=1)
    ]
    for start_s in (0.0, 10.0, 20.0, 30.0, 40.0):
        events += [planned((NAVIGATE, start_s, start_s + 6.0)), begun(start_s), ended(start_s + 7.0)]
    trace = tmp_path / "trace.jsonl"
    trace.write_text("\n".join(map(to_json, events)) + "\n", encoding="utf-8")
    experience = tmp_path / "experience.sqlite"
    return [str(trace), "--knowledge", str(knowledge), "--experience", str(experience)]


def test_learn_shows_accepts_and_reverts(
    five_trips: list[str], knowledge: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing is written until accepted; then plans take longer; a trace counts once; reverting takes all back."""
    learned = knowledge / "sites" / "tue_lab" / "learned.owl"
    plan = ["plan", "FindEmptyDrink", "room=kitchen", "--knowledge", str(knowledge)]
    assert main(plan) == 0
    before = capsys.readouterr().out
    assert main(["kb", "learn", *five_trips, "--by", "place"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0] == "tue_lab: 1 traces, 5 tries, 5 trips"
    assert [line.split()[:4] for line in told[2:4]] == [
        ["Navigate", "duration_s", "1.5", "1.5"],
        ["amigo_1", "travelFactor", "1", "1"],
    ]
    assert told[5].split() == ["Navigate", "at_bar", "5", "5", "7"]
    assert not learned.exists()
    assert main(["kb", "learn", *five_trips, "--accept"]) == 0
    out, err = capsys.readouterr()
    assert "was taken in before, and counts once" in err
    assert out.endswith(f"accepted: {learned}\n")
    assert main(plan) == 0
    assert capsys.readouterr().out != before
    assert main(["kb", "learn", "--revert", "--knowledge", str(knowledge)]) == 0
    assert "is gone" in capsys.readouterr().out
    assert main(plan) == 0
    assert capsys.readouterr().out == before


def test_learn_tells_what_is_in_use(knowledge: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a robot of which nothing was accepted, that is what is stated; then what was learned of it."""
    seen = tmp_path / "seen.sqlite"
    slow, fast = tries("Kinect", 160, count=90), replace(tries("Kinect", 80, count=90), robot="pico_1")
    Experience(seen).add("one", "tue_lab", [slow, fast], [])
    learn = ["kb", "learn", "--knowledge", str(knowledge), "--experience", str(seen)]
    assert main([*learn, "--accept"]) == 0
    before = capsys.readouterr().out.splitlines()[2:5]
    assert [line.split("duration_s")[1].split()[:3] for line in before] == [
        ["0.08", "0.08", "0.118"],
        ["0.118", "0.08", "0.152"],
        ["0.118", "0.08", "0.087"],
    ]
    assert main(learn) == 0
    after = capsys.readouterr().out.splitlines()[2:5]
    assert [line.split("duration_s")[1].split()[1] for line in after] == ["0.118", "0.152", "0.087"]


def test_learn_refuses_traces_of_elsewhere(
    five_trips: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another site, no trace at all, the shipped folder."""
    trace = tmp_path / "trace.jsonl"
    text = trace.read_text(encoding="utf-8")
    trace.write_text(text.replace('"site":"tue_lab"', '"site":"attic"'), encoding="utf-8")
    assert main(["kb", "learn", *five_trips]) == 2
    assert "is of attic; give traces of tue_lab" in capsys.readouterr().err
    trace.write_text("no trace", encoding="utf-8")
    assert main(["kb", "learn", *five_trips]) == 2
    assert f"{trace}:1: is no event of a trace" in capsys.readouterr().err
    assert main(["kb", "learn", "--accept", "--experience", str(tmp_path / "e")]) == 2
    assert "is shipped, and not changed" in capsys.readouterr().err
    trace.write_text(text.replace('"knowledge":"', '"knowledge":"other'), encoding="utf-8")
    assert main(["kb", "learn", *five_trips]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("tue_lab: 1 traces, 5 tries, 0 trips\n")
    assert "its run had other knowledge" in err
