"""The trace: events to lines and back, and lines for people."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from executive.errors import BadTrace
from executive.trace import (
    BY_KIND,
    ActionFinished,
    ActionStarted,
    FactsTold,
    FleetOpened,
    PlanMade,
    Replanned,
    TaskFinished,
    TraceEvent,
    narrate,
    read_trace,
    to_json,
)

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
JSON: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS, lambda inner: st.lists(inner, max_size=2), max_leaves=4
)
FIELDS: dict[str, st.SearchStrategy[Any]] = {
    "str": TEXTS,
    "int": st.integers(),
    "bool": st.booleans(),
    "float": NUMBERS,
    "list[str]": st.lists(TEXTS, max_size=3),
    "dict[str, str]": st.dictionaries(TEXTS, TEXTS, max_size=3),
    "dict[str, Any]": st.dictionaries(TEXTS, JSON, max_size=3),
    "dict[str, bool | list[float]]": st.dictionaries(TEXTS, st.booleans() | st.lists(NUMBERS, max_size=3), max_size=3),
    "list[tuple[str, str, float, float]]": st.lists(st.tuples(TEXTS, TEXTS, NUMBERS, NUMBERS), max_size=3),
    "list[tuple[str, float, int, int, float, float]]": st.lists(
        st.tuples(TEXTS, NUMBERS, st.integers(), st.integers(), NUMBERS, NUMBERS), max_size=3
    ),
    "str | float | bool | list[float] | None": st.one_of(
        TEXTS, NUMBERS, st.booleans(), st.lists(NUMBERS, max_size=3), st.none()
    ),
}


def events_of(kind: type[TraceEvent]) -> st.SearchStrategy[TraceEvent]:
    """Any events of one kind; a field of a type that is not in the table above is a KeyError."""
    hints = {name: hint for name, hint in kind.__annotations__.items() if not hint.startswith("ClassVar")}
    return st.builds(kind, **{name: FIELDS[hint] for name, hint in hints.items()})


@pytest.mark.parametrize("kind", get_args(TraceEvent), ids=lambda kind: kind.kind)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_every_event_reads_back_as_it_was(tmp_path: Path, kind: type[TraceEvent], data: st.DataObject) -> None:
    """Whatever characters its texts hold, one event is one line, and equal with all its fields after reading."""
    written = data.draw(st.lists(events_of(kind), min_size=1, max_size=3))
    file = tmp_path / "trace.jsonl"
    file.write_text("".join(to_json(event) + "\n" for event in written), encoding="utf-8")
    assert list(read_trace(file)) == written


def test_kinds_are_unique_and_cover_the_union() -> None:
    """Each class of the union is found by its own kind."""
    kinds = [event.kind for event in get_args(TraceEvent)]
    assert len(set(kinds)) == len(kinds)
    assert list(BY_KIND.values()) == list(get_args(TraceEvent))
    assert list(BY_KIND) == kinds


def test_a_line_begins_with_its_kind_and_the_time() -> None:
    """People and `grep` find them there."""
    line = to_json(Replanned(t_s=1.5, task="one", reason="ü"))
    assert line == '{"kind":"replanned","t_s":1.5,"task":"one","reason":"ü"}'


GOOD = to_json(Replanned(t_s=1.5, task="one", reason="so"))


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("", "Expecting value"),
        ("{", "Expecting"),
        ("[1]", "is no event"),
        ("7", "is no event"),
        ('"text"', "is no event"),
        ("null", "is no event"),
        ("[" * 100_000, "recursion"),
        ("{}", "'kind'"),
        ('{"kind":"dance"}', "'dance'"),
        ('{"kind":["replanned"]}', "unhashable"),
        ('{"kind":"replanned","t_s":1.5,"task":"one"}', "missing 1 required keyword-only argument: 'reason'"),
        (GOOD[:-1] + ',"mood":"calm"}', "unexpected keyword argument 'mood'"),
        (GOOD.replace("1.5", '"soon"'), "t_s cannot be 'soon'"),
        (GOOD.replace("1.5", "true"), "t_s cannot be True"),
        (GOOD.replace("1.5", "null"), "t_s cannot be None"),
        (GOOD.replace('"so"', "[]"), "reason cannot be []"),
        ('{"kind":"facts_told","t_s":1,"task":"","prop":"","subject":"","value":{}}', "value cannot be {}"),
        (
            '{"kind":"fleet_opened","t_s":1,"site":"","robots":[7],"knowledge":"","scenario":"","seed":1}',
            "robots cannot",
        ),
    ],
)
def test_a_bad_line_is_named_by_its_number(tmp_path: Path, line: str, told: str) -> None:
    """The lines before it have been read; the error is the request's fault."""
    file = tmp_path / "trace.jsonl"
    file.write_text(f"{GOOD}\n{line}\n{GOOD}\n", encoding="utf-8")
    events = read_trace(file)
    assert to_json(next(events)) == GOOD
    with pytest.raises(BadTrace) as caught:
        next(events)
    assert caught.value.line == 2
    assert caught.value.fault == "request"
    assert str(caught.value).startswith(f"{file}:2: is no event of a trace: ")
    assert told in str(caught.value)


@pytest.mark.parametrize("steps", ["[[]]", '[["a","b",1.0]]', '[["a","b",1.0,2.0,3.0]]', '[["a","b",1.0,"c"]]', "[7]"])
def test_a_step_of_a_plan_has_four_parts(tmp_path: Path, steps: str) -> None:
    """Action, robot, start and end."""
    plan = PlanMade(t_s=0.0, task="", status="", makespan_s=0.0, lower_bound_s=0.0, steps=[], reason="")
    file = tmp_path / "trace.jsonl"
    file.write_text(to_json(plan).replace('"steps":[]', f'"steps":{steps}'), encoding="utf-8")
    with pytest.raises(BadTrace, match=r"trace\.jsonl:1: is no event of a trace"):
        list(read_trace(file))


@pytest.mark.parametrize("content", [None, b"\xff\xfe{"])
def test_a_file_that_cannot_be_read_is_a_bad_trace(tmp_path: Path, content: bytes | None) -> None:
    """It is missing, or no UTF-8."""
    file = tmp_path / "trace.jsonl"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(BadTrace, match=r"trace\.jsonl:0: cannot be read"):
        list(read_trace(file))


def test_numbers_without_a_fraction_are_numbers(tmp_path: Path) -> None:
    """Other programs may write 1 for 1.0."""
    file = tmp_path / "trace.jsonl"
    file.write_text(GOOD.replace("1.5", "1"), encoding="utf-8")
    assert list(read_trace(file)) == [Replanned(t_s=1.0, task="one", reason="so")]


def test_a_recorded_run_reads_back_to_the_same_bytes(trace_file: Path) -> None:
    """Reading and writing a real trace changes nothing."""
    assert "".join(to_json(event) + "\n" for event in read_trace(trace_file)) == trace_file.read_text(encoding="utf-8")
    assert json.loads(trace_file.read_text(encoding="utf-8").splitlines()[0])["kind"] == "fleet_opened"


# Lines for people


def finished(outcome: str, failure: str, reason: str) -> ActionFinished:
    """The end of an action."""
    return ActionFinished(
        t_s=22.0,
        task="one",
        action="Laser(amigo_1)",
        robot="amigo_1",
        number=1,
        outcome=outcome,
        failure=failure,
        reason=reason,
        planned_s=0.1,
        elapsed_s=0.2,
        outputs={},
    )


@pytest.mark.parametrize(
    ("event", "lines"),
    [
        (
            ActionStarted(
                t_s=21.98,
                task="one",
                action='NavMap(amigo_1,"tue_lab")',
                robot="amigo_1",
                number=1,
                service="/compute/nav_map",
            ),
            ['do [NavMap(amigo_1,"tue_lab")] at time 21.98'],
        ),
        (finished("SUCCEEDED", "", ""), []),
        (
            finished("EXECUTION_FAILED", "NoPath", "it is walled in"),
            ["  [Laser(amigo_1)] EXECUTION_FAILED at time 22.00: NoPath, it is walled in"],
        ),
        (
            FleetOpened(t_s=0.0, site="lab", robots=["a", "b"], knowledge="", scenario="", seed=1),
            ["fleet of lab opened: a, b"],
        ),
        (
            PlanMade(
                t_s=0.5,
                task="one",
                status="SOLVED_OPTIMALLY",
                makespan_s=2.0,
                lower_bound_s=2.0,
                steps=[("Sweep(r1)", "r1", 0.5, 2.5)],
                reason="it is the least",
            ),
            ["one planned at time 0.50: SOLVED_OPTIMALLY, it is the least", "  plan [Sweep(r1)] from 0.50 to 2.50"],
        ),
        (FactsTold(t_s=1.0, task="one", prop="isEmpty", subject="can", value=False), ["  now isEmpty(can) = False"]),
        (FactsTold(t_s=1.0, task="one", prop="hasPoseEstimate", subject="r1", value=[0.0, 0.0, 0.0]), []),
        (FactsTold(t_s=1.0, task="one", prop="hasThing", subject="r1", value=None), []),
        (Replanned(t_s=3.0, task="one", reason="r1 broke"), ["one is planned anew at time 3.00: r1 broke"]),
        (
            TaskFinished(t_s=9.0, task="one", status="failed", reason="no way", took_s=8.5, outputs={}),
            ["one failed at time 9.00 after 8.50 s: no way"],
        ),
    ],
)
def test_people_read(event: TraceEvent, lines: list[str]) -> None:
    """Actions as the paper prints them; what comes with every cycle is left out."""
    assert list(narrate([event])) == lines
