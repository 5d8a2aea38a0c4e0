"""Each construct's example is planned, and the table of constructs in the reference is made of the same list."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from kb.prolog import Entry
from kb.terms import Struct, Term, Var, struct
from tests.planner.constructs import CONSTRUCTS, Construct, table

_REVISION = -3
_ROOT = Path(__file__).parents[2]
_PAGE = _ROOT / "docs" / "reference" / "golog.md"
_BEGIN, _END = (
    "<!-- constructs: written by `pytest tests/planner --update-golden` -->\n",
    "<!-- end of constructs -->\n",
)
_EXAMPLES = [c for c in CONSTRUCTS if c.example is not None]

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_close_session = Entry(search_path="planner_golog", file="steps", name="close_session")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_search_plan = Entry(search_path="planner_golog", file="planning", name="search_plan")

Golden = Callable[[Path, str], None]


def process(name: str, *arguments: str, seconds: int, robots: int) -> list[Term]:
    """The facts of a primitive action; its first arguments are robots."""
    head: Term = Struct(name, tuple(map(Var, arguments))) if arguments else name
    facts: list[Term] = [struct("duration", _REVISION, head, struct("fixed", seconds * 1000))]
    return facts + [struct("agent", _REVISION, head, Var(robot)) for robot in arguments[:robots]]


def workshop() -> list[Term]:
    """The facts of the workshop that tests/planner/constructs.py tells of."""
    robot, thing, frame = Var("Robot"), Var("Thing"), Var("Frame")
    wipe, polish, tidy = (struct(name, robot, thing) for name in ("Wipe", "Polish", "Tidy"))
    kinds = {"anna": ["Robot"], "bert": ["Robot", "RobotWithArm"], "cup": ["Thing"], "jug": ["Thing"]}
    return [
        *(struct("kind", _REVISION, name, kind) for name, its in kinds.items() for kind in its),
        *process("Wipe", "Robot", "Thing", seconds=30, robots=1),
        *process("Polish", "Robot", "Thing", seconds=50, robots=1),
        *process("Count", seconds=10, robots=0),
        *process("Carry", "Robot", "Other", seconds=40, robots=2),
        *process("Look", "Robot", "Seen", seconds=5, robots=1),
        struct("fluent", _REVISION, "dirty", "cup", True),
        struct("effect", _REVISION, wipe, struct("fluent", "dirty", thing), False),
        struct("requires", _REVISION, "Polish", "RobotWithArm"),
        struct("precondition", _REVISION, polish, struct("not", struct("holds", "dirty", thing, True))),
        struct("agent", _REVISION, tidy, robot),
        struct("definition", _REVISION, tidy, frame, [struct("call", frame, "wipe", wipe),
                                                      struct("call", frame, "count", "Count")]),
    ]  # fmt: skip


@pytest.fixture(scope="module")
def _facts() -> Iterator[None]:
    _load_facts(workshop())
    yield
    _drop_facts(_REVISION)


@pytest.mark.usefixtures("_facts")
@pytest.mark.parametrize("construct", _EXAMPLES, ids=lambda c: c.name)
def test_the_plan_of_an_example_is_the_one_that_is_told(construct: Construct) -> None:
    """Makespan and steps, proven to be of least makespan."""
    assert construct.example is not None
    definition = struct("definition", _REVISION, f"Example_{construct.name}", Var("F"), construct.example)
    _load_facts([definition])
    try:
        _open_session(struct("request", "example", _REVISION, f"Example_{construct.name}", 2, 0))
        _look_ahead(struct("ahead", "example", 0, struct("tables", [], [], [])))
        answer = _search_plan(struct("search", "example", 10_000, -1))
    finally:
        _close_session("example")
    assert answer["status"] == "solved_optimally"
    assert construct.makespan_s is not None
    assert answer["makespan"] == answer["bound"] == 1000 * construct.makespan_s
    starts = [(start / 1000, step.removeprefix("example/task/"), "+".join(robots))
              for start, _, step, robots, *_ in answer["steps"]]  # fmt: skip
    assert sorted(starts) == sorted(construct.starts)


def test_every_control_construct_of_the_ontology_is_in_the_list() -> None:
    """And the list has none that the ontology does not have; Split has no term of its own."""
    assert _control_constructs() - {"Split"} == {c.owl for c in CONSTRUCTS if c.owl}


def _control_constructs() -> set[str]:
    """The classes below ControlConstruct in core.owl."""
    core = (_ROOT / "kb" / "ontologies" / "core" / "core.owl").read_text(encoding="utf-8")
    blocks = re.findall(r'<owl:Class rdf:about="[^"]*#(\w+)">(.*?)</owl:Class>', core, re.DOTALL)
    return {name for name, body in blocks if re.search(r'subClassOf rdf:resource="[^"]*#ControlConstruct"', body)}


def test_the_table_of_constructs_is_current(golden: Golden) -> None:
    """What stands between the marks in docs/reference/golog.md is what the list says."""
    page = _PAGE.read_text(encoding="utf-8")
    before, _, rest = page.partition(_BEGIN)
    _, _, after = rest.partition(_END)
    assert after, f"{_PAGE} has no marks for the table"
    golden(_PAGE, f"{before}{_BEGIN}{table()}{_END}{after}")


def test_every_example_has_the_construct_that_it_is_for() -> None:
    """By its functor; a sequence is a list."""
    for construct in _EXAMPLES:
        assert (
            construct.text.startswith("[") if construct.name == "sequence" else f"{construct.name}(" in construct.text
        )
