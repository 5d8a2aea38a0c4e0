"""Robots that say what they should not: nothing hangs or grows, and the trace has one clear reason."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from executive import Fleet, TaskResult, TaskStatus
from executive.trace import ActionFinished
from tests.scenarios.hostile import Hostile, hostile
from tests.scenarios.test_over_rosbridge import served

LASER = "/pico_1/laser"
HOUR_S = 3600


@pytest.fixture(scope="module")
def between() -> Iterator[Hostile]:
    """The simulated robots of the lab behind somebody who spoils what they say."""
    with served() as port, hostile(port) as there:
        yield there


@pytest.fixture
def fleet(between: Hostile) -> Iterator[Fleet]:
    """Connected through that."""
    between.spoil = lambda frame: [frame]
    with Fleet.open("tue_lab", connect=f"ws://127.0.0.1:{between.port}") as opened:
        yield opened


def spoiled(change: Callable[[dict[str, Any]], list[str]]) -> Callable[[str], list[str]]:
    """Change the replies of the laser, and leave all else alone."""

    def spoil(frame: str) -> list[str]:
        told = json.loads(frame)
        return change(told) if told.get("service") == LASER else [frame]

    return spoil


def localized(fleet: Fleet) -> tuple[TaskResult, list[ActionFinished]]:
    """What becomes of a task that needs the laser, and of its calls to it."""
    result = fleet.request("Localize", robot="pico_1", area="tue_lab").wait()
    return result, [e for e in fleet.trace if isinstance(e, ActionFinished) and e.action.startswith("Laser(")]


def _cut_short(told: dict[str, Any]) -> list[str]:
    return [json.dumps(told)[:-20]]


def _of_another_type(told: dict[str, Any]) -> list[str]:
    return [json.dumps(told | {"values": {"scan": {"data": "no scan"}}})]


def _text_for_numbers(told: dict[str, Any]) -> list[str]:
    told["values"]["scan"]["ranges"] = "far"
    return [json.dumps(told)]


def _empty(told: dict[str, Any]) -> list[str]:
    return [json.dumps(told | {"values": {}})]


def _not_a_number_at_all(told: dict[str, Any]) -> list[str]:
    told["values"]["scan"]["angle_min"] = None
    return [json.dumps(told)]


def _of_other_calls(told: dict[str, Any]) -> list[str]:
    return [json.dumps(told | {"id": "call:none"})]


@pytest.mark.parametrize(
    ("change", "failure", "reason"),
    [
        (_cut_short, "NoReply", "/pico_1/laser did not reply within"),
        (_of_another_type, "BadReply", "data"),
        (_text_for_numbers, "BadReply", "ranges"),
        (_empty, "BadReply", "scan"),
        (_of_other_calls, "NoReply", "/pico_1/laser did not reply within"),
    ],
)
def test_a_reply_that_is_none_fails_the_action_with_its_reason(
    between: Hostile, fleet: Fleet, change: Callable[[dict[str, Any]], list[str]], failure: str, reason: str
) -> None:
    """Each try is told, the task ends with what was wrong, and the next one is done as if nothing had been."""
    between.spoil = spoiled(change)
    result, tries = localized(fleet)
    assert result.status is TaskStatus.FAILED
    assert {e.failure for e in tries} == {failure}
    assert all(reason in e.reason for e in tries)
    assert reason in result.reason
    between.spoil = lambda frame: [frame]
    assert localized(fleet)[0].status is TaskStatus.COMPLETED


def test_a_scan_without_directions_cannot_be_used(between: Hostile, fleet: Fleet) -> None:
    """Where its beams point is no number: who computes with it says so."""
    between.spoil = spoiled(_not_a_number_at_all)
    result, _ = localized(fleet)
    assert result.status is TaskStatus.FAILED
    assert "angle_min" in result.reason


def test_a_flood_ends_the_connection_and_not_the_task(between: Hostile, fleet: Fleet) -> None:
    """A reply far above what a message may have: the connection is lost, why is told, and it comes again."""

    def once(told: dict[str, Any]) -> list[str]:
        between.spoil = lambda frame: [frame]
        return [json.dumps(told) + " " * 65_000_000]

    between.spoil = spoiled(once)
    result, (first, *_, last) = localized(fleet)
    assert result.status is TaskStatus.COMPLETED, result.reason
    assert (first.failure, last.failure) == ("Lost", "")
    assert "exceeds limit of 64000000 bytes" in first.reason


@pytest.mark.parametrize("times", [1, 50])
def test_what_nobody_asked_for_changes_nothing(between: Hostile, fleet: Fleet, times: int) -> None:
    """Second replies, replies to nobody's calls, and what is no operation, before and after what was asked for."""

    def more(told: dict[str, Any]) -> list[str]:
        other = json.dumps(told | {"id": "call:none"})
        return [*["{", "[]", '{"op": "dance"}', other] * times, *[json.dumps(told)] * (1 + times), other]

    between.spoil = spoiled(more)
    result, tries = localized(fleet)
    assert result.status is TaskStatus.COMPLETED
    assert len(tries) == 1


@pytest.mark.parametrize("off_s", [-HOUR_S, HOUR_S])
def test_clocks_that_disagree(between: Hostile, fleet: Fleet, off_s: int) -> None:
    """The time of what a robot does is that of our clock, whatever its own says."""

    def late(told: dict[str, Any]) -> list[str]:
        stamp = told["values"]["scan"]["header"]["stamp"]
        stamp["sec"] = max(0, stamp["sec"] + off_s)
        return [json.dumps(told)]

    between.spoil = spoiled(late)
    result, tries = localized(fleet)
    assert result.status is TaskStatus.COMPLETED
    assert all(0.0 <= e.elapsed_s < HOUR_S and e.t_s < HOUR_S for e in tries)
