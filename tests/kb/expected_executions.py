"""What may be done when a random program is executed, found from its tree without the compiler."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from tests.kb.process_graphs import DOORS, ROBOTS, SKILLED, TOKENS, Graph, Node, Program, Ref

MOST_EXECUTIONS = 300

Counts = tuple[tuple[str, int], ...]
"""How often each atomic process is done, by name."""


class TooMany(Exception):
    """There are more executions than are worth counting, or any number of them."""


def executions(program: Program) -> set[Counts]:
    """What may be done so that Main ends: how often each atomic process, where every Look sees something.

    Raises:
        TooMany: A tree iterates, or has more than `MOST_EXECUTIONS`.
    """
    return _performed("Main", program.whole, program, ROBOTS[0], "door_1")


def _performed(process: str, tree: Node, program: Program, robot: str, door: str) -> set[Counts]:
    """What a robot may do that is to do a process."""
    return _executions(tree, program, robot, door) if _may(process, program, robot) else set()


def _executions(node: Node, program: Program, robot: str, door: str) -> set[Counts]:
    def inner(child: Node, at: str = door, by: str = robot) -> set[Counts]:
        return _executions(child, program, by, at)

    match node.kind:
        case "Perform":
            if node.value == "Part":
                if not _may("Part", program, robot):
                    return set()
                recipes = program.of_part.items()
                return _few(set[Counts]().union(*(_performed(n, tree, program, robot, door) for n, tree in recipes)))
            if node.value == "Again" and not _may("Again", program, robot):
                return set()
            if node.value == "Again":
                each, last = program.again
                turn = [_once("Spend"), inner(each)]
                several = [_all([*(turn * n), _once("Check"), inner(last)]) for n in range(1, len(TOKENS) + 1)]
                return _few(set[Counts]().union(*several))
            possible = node.value != "Pass" or DOORS[door][0]
            return _once(str(node.value)) if possible else set()
        case "Choice":
            return _few(set[Counts]().union(*map(inner, node.parts)))
        case "IfThenElse":
            assert node.condition is not None
            chosen = node.parts[:1] if _holds_at(node.condition, door) else node.parts[1:]
            return _all(map(inner, chosen))
        case "Await":
            assert node.condition is not None
            return {()} if _holds_at(node.condition, door) else set()
        case "ForEach":
            assert node.condition is not None
            return _all(inner(node.parts[0], d) for d in DOORS if _holds_at(node.condition, d))
        case "RepeatWhile" | "Interrupt":
            return {()}  # after a Look, and as nothing is that wide
        case "Iterate":
            raise TooMany
        case "Pick" if node.over == "robot":
            return _few(set[Counts]().union(*(inner(node.parts[0], by=r) for r in ROBOTS)))
        case _:
            return _all(map(inner, node.parts))


def _may(process: str, program: Program, robot: str) -> bool:
    """Whether a robot has what a process requires: itself, and by all that it may come to but for choices."""
    return robot == SKILLED or not _requires(process, program)


def _requires(process: str, program: Program) -> bool:
    match process:
        case "Part":
            return all(_requires(recipe, program) for recipe in program.of_part)
        case "Again":
            return process in program.skilled or all(_asks(tree, program) for tree in program.again)
        case "Main":
            return _asks(program.whole, program)
        case _:
            return process in program.skilled or _asks(program.of_part[process], program)


def _asks(node: Node, program: Program) -> bool:
    """Whether part of a process requires a skilled robot of who does the process."""
    match node.kind:
        case "Perform":
            return node.value in ("Part", "Again") and _requires(str(node.value), program)
        case "Choice":
            return all(_asks(part, program) for part in node.parts)
        case "Iterate":
            return False  # it may be done no time
        case "Pick" if node.over == "robot":
            return False  # of another one
        case _:
            return any(_asks(part, program) for part in node.parts)


def _once(process: str) -> set[Counts]:
    return {((process, 1),)}


def _all(each: Iterable[set[Counts]]) -> set[Counts]:
    whole: set[Counts] = {()}
    for counts in each:
        whole = _few({_sum(a, b) for a in whole for b in counts})
    return whole


def _sum(one: Counts, other: Counts) -> Counts:
    total = dict(one)
    for name, number in other:
        total[name] = total.get(name, 0) + number
    return tuple(sorted(total.items()))


def _few(counts: set[Counts]) -> set[Counts]:
    if len(counts) > MOST_EXECUTIONS:
        raise TooMany
    return counts


def _holds_at(condition: Node, door: str) -> bool:
    match condition.kind:
        case "AllOf":
            return all(_holds_at(c, door) for c in condition.parts)
        case "AnyOf":
            return any(_holds_at(c, door) for c in condition.parts)
        case "Not":
            return not _holds_at(condition.parts[0], door)
        case "Holds":
            return DOORS[door][0] == condition.value
        case "Compare":
            return DOORS[door][1] >= float(condition.value)
        case _:
            return True  # every Look sees something


# --------------------------------------------------------------------------------------------- order


def in_order(graph: Graph) -> set[tuple[str, str]]:
    """Steps and for-eaches of one process of which the first has ended before the second begins, by name.

    The parts of a sequence are one after the other, but what follows a split does not wait for it.
    """
    pairs = set()
    for rows in graph.rows.values():
        if "#Sequence" not in str(rows[0][1]):
            continue
        steps = sorted(_links(rows, "hasStep"), key=lambda s: int(str(dict(graph.rows[s])["core:stepNumber"])))
        for number, first in enumerate(steps):
            if "#Split" not in str(graph.rows[first][0][1]) or "#SplitJoin" in str(graph.rows[first][0][1]):
                later = [name for step in steps[number + 1 :] for name in _named(graph, step)]
                pairs |= {(name, other) for name in _named(graph, first) for other in later}
    return pairs


def _named(graph: Graph, construct: str) -> list[str]:
    """What stands in the ids of the actions below a construct."""
    rows = graph.rows[construct]
    if str(rows[0][1]).endswith(("#Perform", "#ForEach")):
        return [construct]
    links = [n for prop in ("hasStep", "thenStep", "elseStep", "bodyStep") for n in _links(rows, prop)]
    return [name for link in links for name in _named(graph, link)]


def _links(rows: Sequence[tuple[str, object]], prop: str) -> list[str]:
    return [value.name for key, value in rows if key == f"core:{prop}" and isinstance(value, Ref)]


def apart(graph: Graph) -> set[tuple[str, str]]:
    """Steps and for-eaches of one process that never overlap, by name: those in different parts of an any-order."""
    pairs = set()
    for rows in graph.rows.values():
        if str(rows[0][1]).endswith("#AnyOrder"):
            parts = [_named(graph, part) for part in _links(rows, "hasStep")]
            pairs |= {(a, b) for n, one in enumerate(parts) for other in parts[:n] for a in one for b in other}
    return pairs


def overlapping(
    starts: Mapping[str, int], ends: Mapping[str, int], pairs: set[tuple[str, str]]
) -> list[tuple[str, str]]:
    """Actions, by id, that overlap though they are never to.

    Args:
        starts: When each has started; none twice.
        ends: When each has ended, of those that have.
    """
    either_way = pairs | {(b, a) for a, b in pairs}
    one_way = set(misordered(starts, ends, either_way))
    return [(a, b) for a, b in one_way if (b, a) in one_way]


def misordered(
    starts: Mapping[str, int], ends: Mapping[str, int], pairs: set[tuple[str, str]]
) -> list[tuple[str, str]]:
    """Actions, by id, of which the second has started too early.

    An id is the path of steps that led to the action: where two paths part, the steps of one invocation differ.

    Args:
        starts: When each has started; none twice.
        ends: When each has ended, of those that have.
    """
    found = []
    for first, second in ((a, b) for a in starts for b in starts if a != b):
        apart = next(((a, b) for a, b in zip(first.split("/"), second.split("/"), strict=False) if a != b), None)
        if apart in pairs and not (first in ends and ends[first] < starts[second]):
            found.append((first, second))
    return found
