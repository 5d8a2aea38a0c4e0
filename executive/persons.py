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
        self._open: dict[int, Callback] = {}

    def ask(self, asked: AskPerson) -> None:
        """Put a question to all who listen; without an answer in time, nobody has helped."""
        until_s = self._clock.now_s + asked.limit_s
        reason = f"nobody has answered for {asked.limit_s:.0f} s"

        def give_up() -> None:
            self.answer(asked.number, helped=False, reason=reason)

        self._open[asked.number] = self._clock.call_at(until_s, give_up)
        question = Question(number=asked.number, task=asked.task, text=asked.question, until_s=until_s)
        for listener in self.listeners:
            listener(question)

    def answer(self, number: int, *, helped: bool, reason: str) -> bool:
        """Take an answer; false if the question is not open any more."""
        forget = self._open.pop(number, None)
        if forget is None:
            return False
        forget()
        self._post(PersonAnswered(number=number, helped=helped, reason=reason))
        return True
