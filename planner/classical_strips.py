"""Ground operators as a classical problem without time, for planners that know nothing but STRIPS.

One robot after the other is enough to tell whether a goal can be reached at all: operators have their
conditions at the start and their effects at the end, so that any concurrent plan can be done in sequence.
What has not to hold has a fact of its own (Gazen and Knoblock, "Combining the expressivity of UCPOP with
the efficiency of Graphplan", 1997).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from unified_planning.environment import Environment
from unified_planning.model import Fluent, InstantaneousAction, Problem

from kb.terms import Value
from planner.classical_ground import POSITION, Fact, Ground, Literal, Subject, World


class Strips:
    """A classical problem, and the ground operators that its actions stand for.

    Attributes:
        problem: Fluents without parameters, actions without parameters, no negation.
        steps: What an action stands for, by name.
    """

    def __init__(self, world: World, goal: frozenset[Literal], times: Mapping[Fact, int]) -> None:
        """Make a problem of what can be reached.

        Args:
            times: When each fact can hold at the earliest; what is not in there never does.
        """
        self._world = world
        self._env = Environment()
        self._env.credits_stream = None
        self.problem = Problem("ground", self._env)
        self.steps: dict[str, Ground] = {}
        grounds = [g for g in world.ground if world.earliest_of(g.conditions, times) is not None]
        asked = set(goal).union(*(g.conditions for g in grounds))
        robots = sorted({robot for ground in grounds for robot, _, _ in ground.travels})
        asked |= {((POSITION, robot, at), True) for robot in robots for at in self._positions(robot, times)}
        self._fluents: dict[Literal, Fluent] = {}
        for number, literal in enumerate(sorted(asked, key=repr)):
            fluent = Fluent(f"f{number}", self._env.type_manager.BoolType(), environment=self._env)
            self._fluents[literal] = fluent
            self.problem.add_fluent(fluent, default_initial_value=world.holds(literal[0]) is literal[1])
        self._of: dict[Subject, list[Literal]] = {}
        for literal in self._fluents:
            self._of.setdefault(literal[0][:2], []).append(literal)
        for ground in grounds:
            for starts, _ in world.origins(ground):
                self._add(ground, starts)
        for literal in sorted(goal, key=repr):
            self.problem.add_goal(self._fluents[literal])

    def _positions(self, robot: str, times: Mapping[Fact, int]) -> Iterator[Value]:
        for prop, subject, value in times:
            if (prop, subject) == (POSITION, robot):
                yield value

    def _add(self, ground: Ground, starts: Sequence[str]) -> None:
        positions: list[Literal] = [
            ((POSITION, robot, start), True) for (robot, _, _), start in zip(ground.travels, starts, strict=True)
        ]
        effects = [
            (literal, (literal[0][2] == value) is literal[1])
            for subject, value in ground.effects.items()
            for literal in self._of.get(subject, ())
        ]
        if any(literal not in self._fluents for literal in positions) or not effects:
            return
        name = f"a{len(self.steps)}"
        self.steps[name] = ground
        action = InstantaneousAction(name, _env=self._env)
        for literal in [*positions, *sorted(ground.conditions, key=repr)]:
            action.add_precondition(self._fluents[literal])
        for literal, becomes in effects:
            action.add_effect(self._fluents[literal], becomes)
        self.problem.add_action(action)
