"""The same for temporal planners: instances as unified-planning problems, flat and hierarchical.

Without fetching: durative actions `navigate` and `detect`, and the goal that every drink is found; hierarchical, a task
`find` for every drink, which is to be where it is (perhaps by driving there) and then to detect it.

Coupled: as a robot does nothing else while it fetches, and sets off when the drink has been found, driving is part of
`find` and `collect` there; flat, the robot's stage (`free`, `loaded`, `outside`, `done`) keeps the acts in order.

Travel times depend on the robot through its speed only: a table for each robot would make the message to up-aries
larger than the 4 MiB that it takes. Unit of time: 0.1 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from unified_planning.model.htn import HierarchicalProblem, Method
from unified_planning.model.metrics import MinimizeMakespan
from unified_planning.shortcuts import (
    BoolType,
    DurativeAction,
    EndTiming,
    Equals,
    Fluent,
    IntType,
    Not,
    Problem,
    StartTiming,
    UserType,
)

from tests.benchmarks.fleets import (
    COLLECT,
    DETECT_MS,
    FIND,
    GRASP_MS,
    LEAVE,
    PASS_MS,
    RETURN,
    SERVE,
    Act,
    Instance,
)

UNIT_MS = 100
_LONGEST = 1_000_000

_ACTS = {"detect": FIND, "find_it": FIND, "collect": COLLECT, "leave": LEAVE, "serve": SERVE, "return": RETURN}


class FleetProblem:
    """A problem of unified-planning in the making."""

    def __init__(self, instance: Instance, *, hierarchical: bool) -> None:
        self.problem: Any = (HierarchicalProblem if hierarchical else Problem)("fleet")
        self._instance = instance
        self._hierarchical = hierarchical
        self._robot, self._place = UserType("robot"), UserType("place")
        self._drink, self._speed = UserType("drink"), UserType("speed")
        self._at = self._fluent("at", self._place, None, r=self._robot)
        self._free = self._fluent("free", BoolType(), True, r=self._robot)
        self._found = self._fluent("found", BoolType(), False, d=self._drink)
        self._spot = self._fluent("spot", self._place, None, d=self._drink)
        self._finds = self._fluent("finds", BoolType(), False, r=self._robot, d=self._drink)
        self._drives = self._fluent("drives", self._speed, None, r=self._robot)
        legs = {"v": self._speed, "a": self._place, "b": self._place}
        self._takes = self._fluent("takes", IntType(0, _LONGEST), _LONGEST, **legs)
        self._objects()
        if instance.coupled:
            self._coupled()
        else:
            self._separable()
        self.problem.add_quality_metric(MinimizeMakespan())

    def _fluent(self, name: str, kind: Any, default: Any, **parameters: Any) -> Any:
        fluent = Fluent(name, kind, **parameters)
        self.problem.add_fluent(fluent, **({} if default is None else {"default_initial_value": default}))
        return fluent

    def _objects(self) -> None:
        instance, problem = self._instance, self.problem
        self._robots = [problem.add_object(f"r{r}", self._robot) for r in range(instance.robots)]
        count = len(instance.xy_dm) if instance.coupled else instance.inside
        self._places = [problem.add_object(f"p{p}", self._place) for p in range(count)]
        self._drinks = [problem.add_object(f"d{d}", self._drink) for d in range(instance.drinks)]
        self._speeds = {v: problem.add_object(f"v{v}", self._speed) for v in sorted(set(instance.speed_mps))}
        for mps, speed in self._speeds.items():
            for a, start in enumerate(self._places):
                for b, goal in enumerate(self._places):
                    takes = instance.alike_travel_ms(mps, a, b) // UNIT_MS
                    problem.set_initial_value(self._takes(speed, start, goal), takes)
        for r, robot in enumerate(self._robots):
            problem.set_initial_value(self._at(robot), self._places[r])
            problem.set_initial_value(self._drives(robot), self._speeds[instance.speed_mps[r]])
        for d, drink in enumerate(self._drinks):
            problem.set_initial_value(self._spot(drink), self._places[instance.spot(d)])
            for r in instance.finders(d):
                problem.set_initial_value(self._finds(self._robots[r], drink), True)

    def _action(self, name: str, takes: Any, begins: Any, ends: Any, **parameters: Any) -> Any:
        """A durative action that needs a stage of its robot, which it is not in meanwhile, and leads to another."""
        action = DurativeAction(name, **parameters)
        action.set_fixed_duration(takes(action) if callable(takes) else takes)
        action.add_condition(StartTiming(), begins(action.r))
        action.add_effect(StartTiming(), begins(action.r), False)
        action.add_effect(EndTiming(), ends(action.r), True)
        self.problem.add_action(action)
        return action

    def _driving(self, action: Any, goal: Any) -> None:
        """The action begins with a drive from `a` to `b`, which is `goal`."""
        action.add_condition(StartTiming(), Equals(self._at(action.r), action.a))
        action.add_condition(StartTiming(), Equals(self._drives(action.r), action.v))
        action.add_condition(StartTiming(), Equals(goal, action.b))

    def _separable(self) -> None:
        legs = {"r": self._robot, "v": self._speed, "a": self._place, "b": self._place}
        navigate = self._action("navigate", lambda x: self._takes(x.v, x.a, x.b), self._free, self._free, **legs)
        navigate.add_condition(StartTiming(), Equals(self._at(navigate.r), navigate.a))
        navigate.add_condition(StartTiming(), Equals(self._drives(navigate.r), navigate.v))
        navigate.add_condition(StartTiming(), Not(Equals(navigate.a, navigate.b)))
        navigate.add_effect(EndTiming(), self._at(navigate.r), navigate.b)
        takes = DETECT_MS // UNIT_MS
        detect = self._action("detect", takes, self._free, self._free, r=self._robot, d=self._drink)
        detect.add_condition(StartTiming(), Equals(self._at(detect.r), self._spot(detect.d)))
        detect.add_condition(StartTiming(), self._finds(detect.r, detect.d))
        detect.add_effect(EndTiming(), self._found(detect.d), True)
        if not self._hierarchical:
            for drink in self._drinks:
                self.problem.add_goal(self._found(drink))
            return
        find = self.problem.add_task("find", d=self._drink)
        come = self.problem.add_task("come", r=self._robot, b=self._place)
        there = Method("there", r=self._robot, b=self._place)
        there.set_task(come, there.r, there.b)
        there.add_precondition(Equals(self._at(there.r), there.b))
        drive = Method("drive", r=self._robot, v=self._speed, a=self._place, b=self._place)
        drive.set_task(come, drive.r, drive.b)
        drive.add_subtask(navigate, drive.r, drive.v, drive.a, drive.b)
        look = Method("look", r=self._robot, d=self._drink, b=self._place)
        look.set_task(find, look.d)
        look.add_precondition(Equals(self._spot(look.d), look.b))
        look.add_precondition(self._finds(look.r, look.d))
        look.set_ordered(look.add_subtask(come, look.r, look.b), look.add_subtask(detect, look.r, look.d))
        for method in (there, drive, look):
            self.problem.add_method(method)
        for drink in self._drinks:
            self.problem.task_network.add_subtask(find, drink)

    def _coupled(self) -> None:
        instance, problem = self._instance, self.problem
        inside = self._places[instance.inside]
        loaded, outside, done = (
            self._fluent(name, BoolType(), False, r=self._robot) for name in ("loaded", "outside", "done")
        )
        has_arm = self._fluent("has_arm", BoolType(), False, r=self._robot)
        fetched = self._fluent("fetched", BoolType(), False, d=self._drink)
        carries = self._fluent("carries", BoolType(), False, r=self._robot, d=self._drink)
        door_free = self._fluent("door_free", BoolType(), True)
        serving = self._fluent("serving", IntType(0, _LONGEST), 0, v=self._speed)
        for mps, speed in self._speeds.items():
            robot = instance.speed_mps.index(mps)
            problem.set_initial_value(
                serving(speed), instance.duration_ms(SERVE, robot, 0, instance.outside) // UNIT_MS
            )
        for r in instance.fetchers():
            problem.set_initial_value(has_arm(self._robots[r]), True)

        legs = {"r": self._robot, "d": self._drink, "v": self._speed, "a": self._place, "b": self._place}
        find = self._action(
            "find_it", lambda x: self._takes(x.v, x.a, x.b) + DETECT_MS // UNIT_MS, self._free, self._free, **legs
        )
        self._driving(find, self._spot(find.d))
        find.add_condition(StartTiming(), self._finds(find.r, find.d))
        find.add_effect(EndTiming(), self._at(find.r), find.b)
        find.add_effect(EndTiming(), self._found(find.d), True)
        collect = self._action(
            "collect",
            lambda x: self._takes(x.v, x.a, x.b) + GRASP_MS // UNIT_MS + self._takes(x.v, x.b, inside),
            self._free,
            loaded,
            **legs,
        )
        self._driving(collect, self._spot(collect.d))
        collect.add_condition(StartTiming(), has_arm(collect.r))
        collect.add_condition(StartTiming(), self._found(collect.d))
        collect.add_condition(StartTiming(), Not(fetched(collect.d)))
        collect.add_effect(EndTiming(), self._at(collect.r), inside)
        collect.add_effect(EndTiming(), carries(collect.r, collect.d), True)
        one = {"r": self._robot, "d": self._drink}
        leave = self._action("leave", PASS_MS // UNIT_MS, loaded, outside, **one)
        serve = self._action("serve", lambda x: serving(x.v), outside, done, **one, v=self._speed)
        serve.add_condition(StartTiming(), Equals(self._drives(serve.r), serve.v))
        back = self._action("return", PASS_MS // UNIT_MS, done, self._free, **one)
        for action in (leave, serve, back):
            action.add_condition(StartTiming(), carries(action.r, action.d))
        for action in (leave, back):
            action.add_condition(StartTiming(), door_free)
            action.add_effect(StartTiming(), door_free, False)
            action.add_effect(EndTiming(), door_free, True)
        back.add_effect(EndTiming(), carries(back.r, back.d), False)
        back.add_effect(EndTiming(), fetched(back.d), True)
        if not self._hierarchical:
            for drink in self._drinks:
                problem.add_goal(fetched(drink))
            return
        bring = problem.add_task("bring", d=self._drink)
        method = Method(
            "bring_it",
            d=self._drink,
            b=self._place,
            f=self._robot,
            fv=self._speed,
            fa=self._place,
            r=self._robot,
            v=self._speed,
            a=self._place,
        )
        method.set_task(bring, method.d)
        method.add_precondition(Equals(self._spot(method.d), method.b))
        method.set_ordered(
            method.add_subtask(find, method.f, method.d, method.fv, method.fa, method.b),
            method.add_subtask(collect, method.r, method.d, method.v, method.a, method.b),
            method.add_subtask(leave, method.r, method.d),
            method.add_subtask(serve, method.r, method.d, method.v),
            method.add_subtask(back, method.r, method.d),
        )
        problem.add_method(method)
        for drink in self._drinks:
            problem.task_network.add_subtask(bring, drink)


def acts(plan: Any) -> Sequence[Act]:
    """What a plan of unified-planning does, in order of start."""
    timed = getattr(plan, "action_plan", plan).timed_actions
    found = []
    for start, action, _ in timed:
        if action.action.name in _ACTS:
            robot, drink = (int(str(parameter)[1:]) for parameter in action.actual_parameters[:2])
            found.append((start, _ACTS[action.action.name], robot, drink))
    return [(what, robot, drink) for _, what, robot, drink in sorted(found)]
