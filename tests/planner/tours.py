"""Plans for FindEmptyDrink put together by hand: who visits which drinks in which order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from kb.store import Snapshot
from kb.terms import Action, Argument, Data, Fluent, Value
from planner.plan import Plan, PlannedStep, PlanStatus

_STEPS = (
    ("SearchDrink_10_Navigate", "Navigate"),
    ("SearchDrink_20_Localize/Localize_10_LocMap", "LocMap"),
    ("SearchDrink_20_Localize/Localize_20_Laser", "Laser"),
    ("SearchDrink_20_Localize/Localize_30_Pose", "Pose"),
    ("SearchDrink_30_Kinect", "Kinect"),
    ("SearchDrink_40_Detection", "Detection"),
)


def lab_with(lab: Snapshot, robots: int, drinks: int) -> Snapshot:
    """A lab with amigo_1, amigo_2, ... and drink_1, drink_2, ..., each drink at a location of its own: `spot_1`, ..."""
    kinds, values = dict(lab.ontology.kinds), dict(lab.ontology._values)
    copies = [("amigo_1", f"amigo_{n}") for n in range(2, robots + 1)]
    copies += [("drink_1", f"drink_{n}") for n in range(2, drinks + 1)]
    copies += [("at_coffee_table", f"spot_{n}") for n in range(1, drinks + 1)]
    for old, new in copies:
        kinds[new] = lab.ontology.kinds[old]
        values |= {(prop, new): v for (prop, subject), v in lab.ontology._values.items() if subject == old}
    values |= {("locatedAt", f"drink_{n}"): (f"spot_{n}",) for n in range(1, drinks + 1)}
    fluents = {key: value for key, value in lab.fluents.items() if not key[1].startswith("drink_")}
    return replace(lab, ontology=replace(lab.ontology, kinds=kinds, _values=values), fluents=fluents)


def tours_plan(lab: Snapshot, tours: Mapping[str, Sequence[str]], times: Mapping[tuple[str, str, str], float]) -> Plan:
    """The plan in which each robot visits its drinks one after the other, as early as it can."""
    steps: list[PlannedStep] = []
    choices: dict[str, tuple[str | int, ...]] = {"task/task/recipe": (1,)}
    for robot, drinks in tours.items():
        now_ms, at = 0, "here"
        for drink in drinks:
            turn, goal = f"task/task/FindEachDrink/FindEachDrink_body/{drink}", str(lab.value("locatedAt", drink))
            choices[f"{turn}/FindEachDrink_pick"] = (robot,)
            for step, process in _STEPS:
                seconds = lab.ontology.value("duration_s", process)
                took_ms = round(float(seconds) * 1000) if isinstance(seconds, int | float) else 0
                if process == "Navigate":
                    took_ms += round(times[robot, at, goal] * 1000)
                    at = goal
                action = _action(lab, f"{turn}/FindEachDrink_SearchDrink/{step}", process, robot, drink, goal)
                steps.append(PlannedStep(action=action, start_s=now_ms / 1000, end_s=(now_ms + took_ms) / 1000))
                now_ms += took_ms
    end_s = max(step.end_s for step in steps)
    return Plan(
        status=PlanStatus.SOLVED_SATISFICING,
        made_at_s=0.0,
        makespan_s=end_s,
        lower_bound_s=0.0,
        steps=tuple(sorted(steps, key=lambda s: (s.start_s, s.action.robot or "", s.end_s))),
        choices=choices,
        nodes=0,
        reason="",
    )


def _action(lab: Snapshot, step_id: str, process: str, robot: str, drink: str, goal: str) -> Action:
    frame = step_id.rpartition("/")[0]
    search = frame.removesuffix("/SearchDrink_20_Localize")
    values: dict[str, Value] = {
        "robot": robot,
        "area": "tue_lab",
        "drink": drink,
        "location": goal,
        "locMap": Data(f"{frame}/locMap"),
        "lastPose": Fluent("hasPoseEstimate", robot),
        "odometry": Fluent("hasOdometry", robot),
        "position": Data(f"{search.rpartition('/')[0]}/position"),
    }
    arguments = tuple(
        Argument(name=p.name, role=p.role.value, value=values.get(p.name, Data(f"{search}/{p.name}")))
        for p in lab.processes[process].arguments
    )
    return Action(id=step_id, process=process, robots=(robot,), arguments=arguments)
