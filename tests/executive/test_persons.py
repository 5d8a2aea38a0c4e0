"""Questions to persons: who hears them, and how they end."""

from __future__ import annotations

import pytest

from executive.events import AskPerson, Event, PersonAnswered
from executive.persons import Persons, Question
from kb.clock import SimClock

ASKED = AskPerson(number=4, task="one", question="it smokes", limit_s=30.0)


class Trial:
    """Persons who listen, and what was told of them."""

    def __init__(self) -> None:
        self.clock, self.posted, self.heard = SimClock(), list[Event](), list[Question]()
        self.persons = Persons(self.clock, self.posted.append)
        self.persons.listeners.append(self.heard.append)
        self.persons.ask(ASKED)

    def pass_time(self, until_s: float) -> None:
        """Let time pass."""
        reached: list[bool] = []
        self.clock.call_at(until_s, lambda: reached.append(True))
        assert self.clock.run_until(lambda: bool(reached))


def test_a_question_is_heard_and_answered_once() -> None:
    """Whoever listens hears it with its time; a second answer is none, and no time-out follows."""
    trial = Trial()
    assert trial.heard == [Question(number=4, task="one", text="it smokes", until_s=30.0)]
    assert trial.persons.answer(4, helped=True, reason="put out")
    assert not trial.persons.answer(4, helped=False, reason="no")
    trial.pass_time(40.0)
    assert trial.posted == [PersonAnswered(number=4, helped=True, reason="put out")]


def test_nobody_answers() -> None:
    """After its time the question has ended: nobody has helped."""
    trial = Trial()
    trial.pass_time(29.0)
    assert trial.posted == []
    trial.pass_time(31.0)
    [ended] = trial.posted
    assert ended == PersonAnswered(number=4, helped=False, reason="nobody has answered for 30 s", in_time=False)
    assert not trial.persons.answer(4, helped=True, reason="late")


@pytest.mark.parametrize(("task", "is_open"), [("one", False), ("two", True)])
def test_a_question_of_a_task_that_has_ended_is_withdrawn(task: str, *, is_open: bool) -> None:
    """Those of other tasks stay."""
    trial = Trial()
    trial.persons.withdraw(task)
    assert trial.persons.answer(4, helped=True, reason="put out") is is_open
    trial.pass_time(40.0)
    assert len(trial.posted) == is_open
