"""The person at the terminal, who is asked for help."""

from __future__ import annotations

from queue import SimpleQueue
from threading import Thread

from executive.errors import BadRequest
from executive.exit_codes import complain
from executive.fleet import Fleet
from executive.persons import Question

_ASK = "  can you help? y once you have, n if you cannot: "


class PersonAtTerminal:
    """Puts questions to whoever sits at the terminal, one after the other."""

    def __init__(self, fleet: Fleet, *, is_live: bool) -> None:
        """Listen to a fleet.

        Args:
            is_live: The robots go on while a person thinks; simulated ones wait.
        """
        self._fleet, self._is_live = fleet, is_live
        self._questions: list[Question] = []
        self._answers = SimpleQueue[bool]()
        self._is_asking = False
        fleet.listen(self._questions.append)

    def take_answers(self) -> None:
        """Ask what is open, and tell the fleet what was answered."""
        if self._questions and not self._is_asking:
            self._is_asking = True
            if self._is_live:
                Thread(target=self._ask, daemon=True).start()
            else:
                self._ask()
        while not self._answers.empty():
            helped, question = self._answers.get(), self._questions.pop(0)
            self._is_asking = False
            try:
                self._fleet.answer(question.number, helped=helped)
            except BadRequest as late:
                complain(f"concertmaster: {late}")

    def _ask(self) -> None:
        try:
            answer = input(_ASK)
            while answer.strip().lower() not in ("y", "n"):
                answer = input(_ASK)
        except EOFError:  # nobody is there
            answer = "n"
        self._answers.put(answer.strip().lower() == "y")
