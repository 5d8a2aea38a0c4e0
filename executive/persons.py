"""Persons who can be asked for help: questions go to whoever listens, answers come back as events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from executive.events import AskPerson, Event, PersonAnswered
from kb.clock import Callback, Clock


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """Something that a person may be able to help with.

    Attributes:
        number: What `Fleet.answer` is told.
        text: What has failed, and why, in a sentence.
        until_s: After that time nobody waits for an answer any more.
    """

    number: int
    task: str
    text: str
    until_s: float


class Persons:
    """Whoever has said that they listen, and the questions that are open."""

    def __init__(self, clock: Clock, post: Callable[[Event], None]) -> None:
        self.listeners: list[Callable[[Question], None]] = []
        self._clock, self._post = clock, post
        self._open: dict[int, tuple[str, Callback]] = {}

    def ask(self, asked: AskPerson) -> None:
        """Put a question to all who listen; without an answer in time, nobody has helped."""
        until_s = self._clock.now_s + asked.limit_s
        reason = f"nobody has answered for {asked.limit_s:.0f} s"

        def give_up() -> None:
            self._end(PersonAnswered(number=asked.number, helped=False, reason=reason, in_time=False))

        self._open[asked.number] = asked.task, self._clock.call_at(until_s, give_up)
        question = Question(number=asked.number, task=asked.task, text=asked.question, until_s=until_s)
        for listener in self.listeners:
            listener(question)

    def answer(self, number: int, *, helped: bool, reason: str) -> bool:
        """Take an answer; false if the question is not open any more."""
        is_open = number in self._open
        if is_open:
            self._end(PersonAnswered(number=number, helped=helped, reason=reason))
        return is_open

    def withdraw(self, task: str) -> None:
        """Let go of the questions of a task that has ended."""
        for number in [number for number, (asking, _) in self._open.items() if asking == task]:
            _, forget_timeout = self._open.pop(number)
            forget_timeout()

    def _end(self, answered: PersonAnswered) -> None:
        _, forget_timeout = self._open.pop(answered.number)
        forget_timeout()
        self._post(answered)
