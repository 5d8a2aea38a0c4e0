"""Flow charts of processes as SVG, in the manner of [RoboEarth] Figures 6 and 11 to 13.

Primitive actions have a single frame, composite processes and task types a double one; what a robot does and what is
computed differ in shape, color and caption. Text is text, colors follow the reader's light or dark scheme, and the
same process gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from xml.sax.saxutils import escape, quoteattr

from kb.blocks import (
    Block,
    Column,
    Item,
    Line,
    Shape,
    Text,
    apart,
    begun,
    box,
    fan,
    framed,
    lines_of_text,
    moved,
    repeated_until,
    repeated_while,
    stack,
)
from kb.lettering import text_width, wrap
from kb.outline import Form, Outline, Side, Step
from kb.vocabulary import Kind

_NAME, _SMALL, _HEAD = 13.0, 10.5, 16.0
_MOST_NAME, _MOST_CONDITION, _MOST_TITLE, _MOST_HEAD = 220.0, 210.0, 330.0, 560.0
_MARGIN = 16.0
_DOUBLE = 3.0
"""Between the two lines of a double frame."""
_BEHIND = 5.0
"""How far the frame behind the frame of a for-each looks out."""
_PLANNED = frozenset({Kind.CHOICE, Kind.ITERATE, Kind.ANY_ORDER, Kind.PICK})
"""What is drawn in the manner of the planner's choices."""
_NOTHING = Block(left=4, right=4, height=0, arrow_in=False)
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

STYLE = """
.chart { font-family: "DejaVu Sans", Verdana, Arial, sans-serif; }
.chart text { fill: #1a1c1e; text-anchor: middle; }
.chart .small, .chart .label { fill: #4a4f55; }
.chart .line { fill: none; stroke: #43484d; stroke-width: 1.3; }
.chart .tip { fill: #43484d; }
.chart .box, .chart .hexagon { fill: #ffffff; stroke: #43484d; stroke-width: 1.3; }
.chart .inner { fill: none; stroke: #43484d; stroke-width: 1; }
.chart .robot { fill: #dcebfb; stroke: #1f5c99; }
.chart .compute { fill: #fdf0d9; stroke: #946200; }
.chart .hexagon { fill: #eef1ee; }
.chart .planner { fill: #f1e6f7; stroke: #713a91; stroke-dasharray: 6 3; }
.chart .frame { fill: #7a8088; fill-opacity: 0.05; stroke: #6b7178; stroke-width: 1.2; }
.chart .title { fill: #7a8088; fill-opacity: 0.14; stroke: none; }
.chart .frame.planner { fill: #f1e6f7; fill-opacity: 0.35; stroke: #713a91; }
.chart .title.planner { fill: #713a91; fill-opacity: 0.14; stroke: none; }
.chart .bar, .chart .start { fill: #1a1c1e; stroke: none; }
.chart .end { fill: none; stroke: #1a1c1e; stroke-width: 1.6; }
@media (prefers-color-scheme: dark) {
  .chart text { fill: #e6e8ea; }
  .chart .small, .chart .label { fill: #b4b9bf; }
  .chart .line, .chart .inner { stroke: #aab0b6; }
  .chart .tip { fill: #aab0b6; }
  .chart .box, .chart .hexagon { fill: #202428; stroke: #aab0b6; }
  .chart .robot { fill: #16324f; stroke: #7db7f0; }
  .chart .compute { fill: #44320d; stroke: #e5b553; }
  .chart .hexagon { fill: #2b302c; }
  .chart .planner { fill: #3a2747; stroke: #c79be0; }
  .chart .frame { stroke: #868d94; }
  .chart .frame.planner { fill: #3a2747; stroke: #c79be0; }
  .chart .bar, .chart .start { fill: #e6e8ea; }
  .chart .end { stroke: #e6e8ea; }
}
"""


def chart(drawn: Outline, *, data: bool = False) -> str:
    """Draw a process.

    Args:
        data: Write into each step what it takes and gives.

    Returns:
        An SVG document.
    """
    return svg(drawn, layout(drawn, data=data))


def layout(drawn: Outline, *, data: bool = False) -> Block:
    """Everything that is drawn, with its place."""
    start = Block(left=6, right=6, height=12, items=(Shape(style="start", x=-6, y=0, width=12, height=12),))
    end = Block(left=7, right=7, height=14, items=(Shape(style="end stop", x=-7, y=0, width=14, height=14),))
    whole = stack([start, _block(drawn.step, data=data), end])
    head, top = lines_of_text(_heading(drawn), 0)
    key, below = _key(drawn.step), top + 14 + whole.height + 24
    # Head and key stand around the middle of the picture, not around the axis of what is drawn.
    middle = (whole.right - whole.left) / 2
    half = max([(whole.left + whole.right) / 2, *(t.width / 2 for t in head), key.left])
    items = (*moved(head, middle, 0), *moved(whole.items, 0, top + 14), *moved(key.items, middle, below))
    return Block(left=half - middle, right=half + middle, height=below + key.height, items=items)


def _heading(drawn: Outline) -> list[tuple[str, str, float]]:
    lines = [(line, "head", _HEAD) for line in wrap(drawn.name, _HEAD, _MOST_HEAD)]
    for text in (drawn.signature, *drawn.notes):
        lines += [(line, "small", _SMALL) for line in wrap(text, _SMALL, _MOST_HEAD)]
    return lines


def _key(step: Step) -> Block:
    """What the frames mean; only what occurs."""
    shown: list[Column] = []
    seen = {(s.form, s.side) for s in _all(step) if s.kind is Kind.PERFORM}
    for form, side, text in (
        (Form.PRIMITIVE, Side.ROBOT, "a robot does it"),
        (Form.PRIMITIVE, Side.COMPUTE, "it is computed"),
        (Form.PRIMITIVE, Side.NEITHER, "primitive action"),
        (Form.COMPOSITE, Side.NEITHER, "composite process"),
        (Form.TASK_TYPE, Side.NEITHER, "task type"),
    ):
        if (form, side) in seen:
            block = _boxed([(text, "small", _SMALL)], form, side)
            shown.append(Column(block=block))
    if any(s.kind in _PLANNED for s in _all(step)):
        shown.append(Column(block=_question("the planner chooses", "planner")))
    block = apart(shown) if shown else _NOTHING
    # The axis is in the middle of the row.
    middle = (block.right - block.left) / 2
    half = (block.left + block.right) / 2
    return Block(left=half, right=half, height=block.height, items=moved(block.items, -middle, 0))


def _all(step: Step) -> Iterable[Step]:
    yield step
    for part in step.parts:
        yield from _all(part.step)


def _block(step: Step, *, data: bool) -> Block:
    """A step as a block."""
    blocks = [_block(part.step, data=data) for part in step.parts]
    columns = [Column(block=block, label=part.label) for block, part in zip(blocks, step.parts, strict=True)]
    body = blocks[0] if blocks else _NOTHING
    match step.kind:
        case Kind.PERFORM:
            return _process(step, blocks, data=data)
        case Kind.SEQUENCE:
            return stack(blocks)
        case Kind.SPLIT:
            return begun(columns)
        case Kind.SPLIT_JOIN:
            return fan(_line_in(), columns, bar="bar")
        case Kind.CHOICE:
            return fan(_question(step.text, "planner"), columns)
        case Kind.IF_THEN_ELSE:
            if len(columns) == 1:
                columns.append(Column(block=_NOTHING, label="no"))
            return fan(_question(step.text), columns)
        case Kind.REPEAT_WHILE:
            return repeated_while(_question(step.text), body)
        case Kind.ITERATE:
            return repeated_while(_question(step.text, "planner"), body)
        case Kind.REPEAT_UNTIL:
            return repeated_until(_question(step.text), body)
        case Kind.AWAIT:
            return _question(step.text)
        case Kind.ANY_ORDER:
            return framed(_title(step.text), apart(columns), "planner", joined=False)
        case Kind.PRIORITIZED:
            return framed(_title(step.text), fan(_line_in(), columns, bar="bar"), "plain")
        case Kind.PICK:
            return framed(_title(step.text), body, "planner")
        case Kind.FOR_EACH:
            return _many(framed(_title(step.text), body, "plain", around=_BEHIND))
        case _:
            return framed(_title(step.text), body, "plain")


def _process(step: Step, inside: list[Block], *, data: bool) -> Block:
    caption = step.side if step.form is Form.PRIMITIVE else step.form if step.form is Form.TASK_TYPE else ""
    lines = [(line, "name", _NAME) for line in wrap(step.text, _NAME, _MOST_NAME)]
    if caption:
        lines.insert(0, (caption, "small", _SMALL))
    if data:
        for begin, names in (("in:", step.given), ("out:", step.made)):
            if names:
                lines += [(line, "small", _SMALL) for line in _flow(begin, names)]
    if inside:
        return _doubled(framed(lines, inside[0], "plain", around=_DOUBLE))
    return _boxed(lines, step.form, step.side)


def _flow(begin: str, names: Sequence[str]) -> list[str]:
    """Names on few lines; `lastPose ← hasPoseEstimate(robot)` stays together where there is room."""
    lines = [begin]
    for number, name in enumerate(names, start=1):
        piece = name + ("," if number < len(names) else "")
        if lines[-1] != begin and text_width(f"{lines[-1]} {piece}", _SMALL) > _MOST_NAME:
            lines.append(piece)
        else:
            lines[-1] += f" {piece}"
    return [part for line in lines for part in wrap(line, _SMALL, _MOST_NAME)]


def _boxed(lines: list[tuple[str, str, float]], form: Form, side: Side) -> Block:
    if form is Form.PRIMITIVE:
        return box(lines, f"box {side}".strip(), inset=8)
    return _doubled(box(lines, "box", inset=8 + _DOUBLE), inset=_DOUBLE)


def _doubled(block: Block, inset: float = 0.0) -> Block:
    """The frame of a block twice: inside, or where there is no room, around it."""
    place = next(n for n, i in enumerate(block.items) if isinstance(i, Shape))
    first = block.items[place]
    assert isinstance(first, Shape)
    by = inset or -_DOUBLE
    second = Shape(
        style="inner", x=first.x + by, y=first.y + by, width=first.width - 2 * by, height=first.height - 2 * by
    )
    items = (*block.items[: place + 1], second, *block.items[place + 1 :])
    return replace(block, items=items)


def _many(block: Block) -> Block:
    """A frame with another one behind it."""
    frame = block.items[0]
    assert isinstance(frame, Shape)
    x, y, right, bottom = frame.x, frame.y, frame.x + frame.width, frame.y + frame.height
    by = _BEHIND
    behind = Line(
        points=((x + by, y), (x + by, y - by), (right + by, y - by), (right + by, bottom - by), (right, bottom - by))
    )
    ways = (Line(points=((0, 0), (0, y))), Line(points=((0, bottom), (0, block.height))))
    return replace(block, items=(*block.items, behind, *ways))


def _question(text: str, style: str = "") -> Block:
    lines = [(line, "name", _SMALL + 1) for line in wrap(text, _SMALL + 1, _MOST_CONDITION)]
    return box(lines, f"hexagon {style}".strip(), inset=7, slant=12)


def _line_in() -> Block:
    """Nothing but the line that leads on."""
    return Block(left=0, right=0, height=0, arrow_in=False)


def _title(text: str) -> list[tuple[str, str, float]]:
    return [(line, "name", _SMALL + 1) for line in wrap(text, _SMALL + 1, _MOST_TITLE)]


# --------------------------------------------------------------------------------------------- SVG


def svg(drawn: Outline, block: Block) -> str:
    """Items as a document."""
    width, height = block.left + block.right + 2 * _MARGIN, block.height + 2 * _MARGIN
    items = moved(block.items, block.left + _MARGIN, _MARGIN)
    steps = ", ".join(dict.fromkeys(s.text for s in _all(drawn.step) if s.kind is Kind.PERFORM))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" class="chart" role="img" width="{_n(width)}" height="{_n(height)}" '
        f'viewBox="0 0 {_n(width)} {_n(height)}" aria-label={quoteattr(_clean("Flow chart of " + drawn.name))}>',
        f"<title>{_text('Flow chart of ' + drawn.name)}</title>",
        f"<desc>{_text(drawn.signature + '. Steps: ' + steps)}</desc>",
        f"<style>{STYLE}</style>",
        *(line for item in items for line in _drawn(item)),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _drawn(item: Item) -> Iterable[str]:
    match item:
        case Text():
            y = item.y + item.size  # the baseline, in a line of 1.3 em
            yield (
                f'<text class="{item.style}" x="{_n(item.x)}" y="{_n(y)}" font-size="{_n(item.size)}">'
                f"{_text(item.text)}</text>"
            )
        case Line():
            points = " ".join(f"{_n(x)},{_n(y)}" for x, y in item.points)
            yield f'<polyline class="line" points="{points}"/>'
            if item.arrow:
                x, y = item.points[-1]
                yield f'<path class="tip" d="M{_n(x)},{_n(y)} l-4,-8 l8,0 z"/>'
        case Shape():
            yield from _shape(item)


def _shape(shape: Shape) -> Iterable[str]:
    x, y, width, height = shape.x, shape.y, shape.width, shape.height
    words = shape.style.split()
    if "hexagon" in words:
        corners = [(x + 12, y), (x + width - 12, y), (x + width, y + height / 2)]
        corners += [(x + width - 12, y + height), (x + 12, y + height), (x, y + height / 2)]
        points = " ".join(f"{_n(a)},{_n(b)}" for a, b in corners)
        yield f'<polygon class="{shape.style}" points="{points}"/>'
    elif words[0] in ("start", "end"):
        center = f'cx="{_n(x + width / 2)}" cy="{_n(y + height / 2)}"'
        yield f'<circle class="{words[0]}" {center} r="{_n(width / 2)}"/>'
        if words[0] == "end":
            yield f'<circle class="start" {center} r="{_n(width / 4)}"/>'
    else:
        rounded = ' rx="10"' if "compute" in words else ""
        yield (
            f'<rect class="{shape.style}" x="{_n(x)}" y="{_n(y)}" width="{_n(width)}" height="{_n(height)}"{rounded}/>'
        )


def _n(value: float) -> str:
    """A number, to a hundredth, the same on every machine."""
    return f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".")


def _clean(text: str) -> str:
    return _NOT_XML.sub("\ufffd", text)


def _text(text: str) -> str:
    return escape(_clean(text))
