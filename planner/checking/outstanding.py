"""What a program comes to next, for people who wonder why a plan does not fit it."""

from __future__ import annotations

from collections.abc import Iterator

from kb.terms import Struct, Term
from planner.checking.constructs import Constructs
from planner.checking.ending import Ending
from planner.checking.moment import Moment, bound
from planner.checking.remainder import DONE, Limited, Node, Ranked, Row, Running, Scope, Side, Todo
from planner.checking.starting import seconds, written


class Outstanding:
    """Names what comes next."""

    def __init__(self, constructs: Constructs, ending: Ending) -> None:
        self._ending = ending
        self._constructs = constructs

    def of(self, node: Node, moment: Moment, frames: tuple[str, ...] | None) -> Iterator[str]:
        """All that has to come before a program can end or go on; that has steps in some frames, if they are given."""
        match node:
            case Todo(term, binding):
                body = self._constructs.opened(node, moment)
                if body is not None and body is not DONE:
                    yield from self.of(body, moment, frames)
                elif node is not DONE and self._ending.ended(node, moment) is None:
                    yield _told(bound(term, binding))
            case Running(step_id):
                if step_id in moment.running:
                    yield f"{step_id} to end"
            case Row(first, rest):
                after = self._ending.ended(first, moment)
                if after is None:
                    yield from self.of(first, moment, frames)
                else:
                    yield from self.of(self._constructs.row(DONE, rest), after, frames)
            case Scope(_, _, _, body):
                yield from self.of(body, moment, frames)
            case Limited(by_ms, body):
                if self._ending.ended(body, moment) is None:
                    yield from self.of(body, moment, frames)
                elif moment.now_ms > by_ms:
                    yield f"what is late for its deadline {seconds(by_ms)}"
            case Side(parts):
                for number in parts if frames is None else node.around(frames):
                    yield from self.of(parts[number], moment, frames)
            case Ranked(ranked):
                for part in ranked:
                    yield from self.of(part, moment, frames)


def _told(term: Term) -> str:
    match term:
        case Struct("call", (frame, step, Struct(name) | str(name))):
            return f"{name} ({frame}/{step})"
        case Struct("test" | "while", (condition, *_)) | Struct("until", (_, condition)):
            return f"{written(condition)} to be settled"
        case Struct("if", (condition, *_)):
            return f"what depends on {written(condition)}"
        case Struct("choice" | "pick" | "foreach" | "star" | "any_order", (frame, step, *_)):
            return f"what {frame}/{step} asks for"
        case _:
            return str(term)
