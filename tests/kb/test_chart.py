"""Flow charts: nothing overlaps, nothing sticks out, whatever the process."""

import itertools
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib as mpl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import ImageFont

from kb.blocks import Block, Line, Shape, Text
from kb.chart import chart, layout
from kb.lettering import text_width, wrap
from kb.outline import Form, Outline, Part, Side, Step, outline, outline_text
from kb.store import KnowledgeBase
from kb.vocabulary import Kind

NAMES = st.text(alphabet="abcdefgMW_ <&'\"é漢", min_size=1, max_size=60)
Box = tuple[float, float, float, float]


def steps() -> st.SearchStrategy[Step]:
    """Processes of all constructs, nested."""
    leaf = st.one_of(
        st.builds(
            Step,
            kind=st.just(Kind.PERFORM),
            text=NAMES,
            form=st.sampled_from(Form),
            side=st.sampled_from(Side),
            given=st.lists(NAMES, max_size=3).map(tuple),
            made=st.lists(NAMES, max_size=2).map(tuple),
        ),
        st.builds(Step, kind=st.just(Kind.AWAIT), text=NAMES),
    )

    def composed(inner: st.SearchStrategy[Step]) -> st.SearchStrategy[Step]:
        def parts(least: int, most: int, labels: tuple[str, ...] = ()) -> st.SearchStrategy[tuple[Part, ...]]:
            listed = st.lists(inner, min_size=least, max_size=most)
            return listed.map(
                lambda found: tuple(Part(label=(labels or ("",) * most)[n], step=s) for n, s in enumerate(found))
            )

        several = [Kind.SEQUENCE, Kind.SPLIT, Kind.SPLIT_JOIN, Kind.ANY_ORDER, Kind.CHOICE]
        one = [Kind.REPEAT_WHILE, Kind.REPEAT_UNTIL, Kind.ITERATE, Kind.FOR_EACH, Kind.PICK, Kind.INTERRUPT]
        one += [Kind.LOOKAHEAD, Kind.DEADLINE, Kind.PERFORM]
        return st.one_of(
            st.builds(Step, kind=st.sampled_from(several), text=NAMES, parts=parts(1, 4)),
            st.builds(Step, kind=st.sampled_from(one), text=NAMES, parts=parts(1, 1), form=st.just(Form.COMPOSITE)),
            st.builds(Step, kind=st.just(Kind.IF_THEN_ELSE), text=NAMES, parts=parts(1, 2, ("yes", "no"))),
            st.builds(Step, kind=st.just(Kind.PRIORITIZED), text=NAMES, parts=parts(1, 3, ("1", "2", "3"))),
        )

    return st.recursive(leaf, composed, max_leaves=12)


def drawn(step: Step, name: str = "Process") -> Outline:
    """A process that consists of a step."""
    return Outline(name=name, signature=f"{name}(robot: Robot)", notes=(), step=step)


def area(item: Shape | Text) -> Box:
    """Left, top, right, bottom."""
    left = item.x - item.width / 2 if isinstance(item, Text) else item.x
    return left, item.y, left + item.width, item.y + item.height


def overlap(one: Box, other: Box) -> bool:
    """By more than a rounding error."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    return width > 0.01 and height > 0.01


def within(inner: Box, outer: Box) -> bool:
    """All of it, but for a rounding error."""
    least = inner[0] - outer[0], inner[1] - outer[1], outer[2] - inner[2], outer[3] - inner[3]
    return min(least) > -0.01


def pieces(line: Line) -> Iterator[Box]:
    """The straight pieces of a line, a tenth of a pixel wide."""
    for (x1, y1), (x2, y2) in itertools.pairwise(line.points):
        assert x1 == x2 or y1 == y2, "lines run straight down or across"
        yield min(x1, x2) - 0.05, min(y1, y2) - 0.05, max(x1, x2) + 0.05, max(y1, y2) + 0.05


def is_solid(shape: Shape) -> bool:
    """Whether lines have to go round it."""
    return shape.style.split()[0] in ("box", "hexagon", "start", "end", "title")


def check(block: Block) -> None:
    """Nothing overlaps, everything is inside, no line runs through a step or a text."""
    page = (-block.left, 0.0, block.right, block.height)
    shapes = [i for i in block.items if isinstance(i, Shape)]
    solid = [area(s) for s in shapes if is_solid(s)]
    texts = [i for i in block.items if isinstance(i, Text)]
    lines = [piece for i in block.items if isinstance(i, Line) for piece in pieces(i)]
    items: list[Shape | Text] = [*shapes, *texts]
    for item in items:
        assert within(area(item), page), item
    for piece in lines:
        assert within(piece, (page[0] - 0.1, page[1] - 0.1, page[2] + 0.1, page[3] + 0.1)), piece
    for one, other in itertools.combinations(solid, 2):
        assert not overlap(one, other), (one, other)
    for text, other_text in itertools.combinations(texts, 2):
        assert not overlap(area(text), area(other_text)), (text, other_text)
    for text in texts:
        inside = [s for s in solid if overlap(area(text), s)]
        assert len(inside) <= 1, text
        assert all(within(area(text), s) for s in inside), text
        assert inside or not text.text or text.style in ("head", "small", "label"), text
    for piece in lines:
        for text in texts:
            assert not overlap(piece, area(text)), (piece, text)
        for x1, y1, x2, y2 in solid:
            # A line may end at the edge of a shape.
            assert not overlap(piece, (x1 + 0.2, y1 + 0.2, x2 - 0.2, y2 - 0.2)), (piece, (x1, y1, x2, y2))


@settings(max_examples=150, deadline=None)
@given(step=steps(), name=NAMES, data=st.booleans())
def test_in_random_processes_nothing_overlaps(step: Step, name: str, data: bool) -> None:
    """All constructs, nested, with names of any length."""
    process = drawn(step, name)
    check(layout(process, data=data))
    ET.fromstring(chart(process, data=data))


@pytest.mark.parametrize("data", [False, True])
@pytest.mark.parametrize("expand", [False, True])
def test_in_all_shipped_processes_nothing_overlaps(shipped: KnowledgeBase, expand: bool, data: bool) -> None:
    """With and without what composite processes consist of, with and without data."""
    snapshot = shipped.snapshot()
    for name in snapshot.processes:
        check(layout(outline(snapshot, name, expand=expand), data=data))


def test_what_overlaps_is_noticed() -> None:
    """The check of this file finds two boxes in one place, a line through a box, and what sticks out."""
    box = Shape(style="box", x=0, y=0, width=10, height=10)
    for items in (
        (box, Shape(style="box", x=5, y=5, width=10, height=5)),
        (box, Line(points=((5, 0), (5, 10)))),
        (box, Text(text="much too long", style="name", size=5, x=5, y=1)),
    ):
        with pytest.raises(AssertionError):
            check(Block(left=0, right=20, height=20, items=items))
    with pytest.raises(AssertionError):
        check(Block(left=0, right=5, height=5, items=(box,)))


def test_text_is_never_wider_than_the_table_says() -> None:
    """Measured with DejaVu Sans, for all characters of European languages and the signs of conditions."""
    font = ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), 1000)
    characters = [*map(chr, range(0x20, 0x7F)), *map(chr, range(0xA0, 0x180)), *"→←≤≥≠—“”…•"]
    assert [c for c in characters if font.getlength(c) > text_width(c, 1000)] == []


@given(text=st.text(max_size=80), most=st.floats(20, 200))
def test_lines_are_as_narrow_as_asked_and_nothing_is_lost(text: str, most: float) -> None:
    """All but spaces are there, in order; only a single character may be wider."""
    lines = wrap(text, 10, most)
    assert "".join("".join(lines).split()) == "".join(text.split())
    assert all(text_width(line, 10) <= most or len(line) == 1 for line in lines)


def test_robots_computing_and_frames_are_told_apart(shipped: KnowledgeBase) -> None:
    """Primitive actions have one frame and say who does them; composite processes have two."""
    root = ET.fromstring(chart(outline(shipped.snapshot(), "SearchDrink")))
    styles = [e.get("class") for e in root.iter() if e.get("class")]
    assert styles.count("box robot") == 2  # Kinect and the key
    assert styles.count("box compute") == 2  # Detection and the key
    assert styles.count("inner") == 3  # Navigate, Localize and the key
    assert {"robot", "compute", "Navigate", "Kinect"} <= {e.text for e in root.iter() if e.tag.endswith("text")}


def test_a_name_and_what_it_is_taken_from_stay_together(shipped: KnowledgeBase) -> None:
    """On one line, where they fit on one."""
    drawing = layout(outline(shipped.snapshot(), "Localize"), data=True)
    texts = [i.text for i in drawing.items if isinstance(i, Text)]
    assert [t for t in texts if "←" in t] == ["lastPose ← hasPoseEstimate(robot),", "odometry ← hasOdometry(robot)"]


def test_the_key_says_what_the_planner_chooses() -> None:
    """Dashed, so that it can be told apart in black and white; only where there is something to choose."""
    step = Step(kind=Kind.PERFORM, text="Laser", side=Side.ROBOT)
    for kind in (Kind.CHOICE, Kind.ITERATE, Kind.ANY_ORDER, Kind.PICK):
        text = chart(drawn(Step(kind=kind, text="which", parts=(Part(label="", step=step),))))
        assert "the planner chooses" in text, kind
    assert "the planner chooses" not in chart(drawn(step))
    assert re.search(r"\.planner \{[^}]*stroke-dasharray", chart(drawn(step)))


def test_a_chart_is_for_everyone(shipped: KnowledgeBase) -> None:
    """It has a title and a description, a role, and colors for both schemes."""
    text = chart(outline(shipped.snapshot(), "Navigate"))
    root = ET.fromstring(text)
    assert root.get("role") == "img"
    assert [e.tag.split("}")[1] for e in root][:2] == ["title", "desc"]
    assert "Localize" in str(root[1].text)
    assert "prefers-color-scheme: dark" in text
    assert text == chart(outline(shipped.snapshot(), "Navigate"))


def test_hostile_names_stay_text() -> None:
    """Markup and characters that XML forbids."""
    step = Step(kind=Kind.PERFORM, text="<script>alert(1)</script>\x00&", side=Side.ROBOT)
    root = ET.fromstring(chart(drawn(step, '"><script>x</script>')))
    assert not [e for e in root.iter() if "script" in e.tag]


def test_expanding_shows_what_composites_consist_of(shipped: KnowledgeBase) -> None:
    """Down to primitive actions."""
    snapshot = shipped.snapshot()
    assert "Laser" not in outline_text(outline(snapshot, "FindEmptyDrink"))
    assert "    Laser [robot]" in outline_text(outline(snapshot, "FindEmptyDrink", expand=True))


def test_an_outline_tells_what_is_given_and_asked(shipped: KnowledgeBase) -> None:
    """Signature, comment, conditions; and with `data`, where arguments come from."""
    snapshot = shipped.snapshot()
    text = outline_text(outline(snapshot, "SearchDrink"), data=True)
    assert "SearchDrink(robot: Robot, area: Area, drink: Drink, location: SearchLocation) → position" in text
    assert "A robot drives to where a drink should be" in text
    assert "before: locatedAt(drink) = location" in text
    assert "Kinect [robot] (robot) → color, depth, calibration" in text
    assert "area ← room" in outline_text(outline(snapshot, "FindEmptyDrink", expand=True), data=True)


def test_the_picture_in_the_documentation_is_current(
    shipped: KnowledgeBase, golden: Callable[[Path, str], None]
) -> None:
    """docs/how-to/find-empty-drink.svg is what `kb show --expand` draws; `pytest --update-golden` writes it."""
    file = Path(__file__).parents[2] / "docs" / "how-to" / "find-empty-drink.svg"
    golden(file, chart(outline(shipped.snapshot(), "FindEmptyDrink", expand=True)))
