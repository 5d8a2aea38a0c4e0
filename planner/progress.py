"""What a session of the planner tells: what starts, begins, ends, is true from now on, and what is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from kb.terms import Action, Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Started:
    """A primitive action may start, and counts as started."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Begun:
    """A composite process has begun with its first action."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """A composite process has ended."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """An effect: from now on, the property of the subject has this value."""

    prop: str
    subject: str
    value: Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Abandoned:
    """A running primitive action is no longer wanted, as the world has changed: stop it, forget its outcome."""

    action: Action


StepEvent: TypeAlias = Started | Begun | Ended | Told | Abandoned


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """What an outcome led to, in order.

    Attributes:
        done: Nothing remains of the program.
        running: How many actions are running now.
        replan: The plan goes no further, or was made for something else than what is so now: plan again.
        own: So many of the facts told, the first, are effects of the action reported; the others are effects of the
            process that ends next.
        released: The action reported was the last of a robot that is no longer capable of what it was to do next;
            another is chosen.
    """

    events: tuple[StepEvent, ...]
    done: bool
    running: int
    replan: bool
    own: int = 0
    released: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Retry:
    """What is left after a failure.

    Attributes:
        excluded: The individual (the robot, as a rule), or the process of a branch, that is chosen no more where it had
            been chosen; None if the program leaves no other choice.
        abandoned: What else was running for that choice, and is no longer wanted.
    """

    excluded: str | None
    abandoned: tuple[Action, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """A robot that cannot do a process, and the capability that it lacks."""

    process: str
    robot: str
    capability: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """Where in its program an action runs.

    Attributes:
        processes: Those that it is part of, the outermost first.
        chosen: What was chosen around it, the innermost first: individuals, and branches by number.
    """

    processes: tuple[Action, ...]
    chosen: tuple[str | int, ...]
