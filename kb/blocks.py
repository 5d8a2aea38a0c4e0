"""The geometry of flow charts: blocks that are put below and beside one another.

A structured program needs no general layout of graphs: every step becomes a block that is entered at the top and
left at the bottom of its axis (x = 0), and blocks are made of blocks. Lines run straight down or across, never
through a shape. Lengths are pixels of the picture.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from kb.lettering import LINE_HEIGHT_EM, text_width

GAP = 22.0
"""Between a block and the next below it: room for an arrow."""
BESIDE = 26.0
"""Between blocks that stand side by side."""
PAD = 14.0
"""Between a frame and what is in it."""
LABEL_SIZE = 11.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Something with an area.

    Attributes:
        style: How it is drawn: `box`, `frame`, `title`, `hexagon`, `bar`, `dot` and so on, one word or several.
    """

    style: str
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A line of text.

    Attributes:
        x: Its middle.
        y: Its top.
        style: `name`, `small` or `label`.
    """

    text: str
    style: str
    size: float
    x: float
    y: float

    @property
    def width(self) -> float:
        """At most."""
        return text_width(self.text, self.size)

    @property
    def height(self) -> float:
        """From line to line."""
        return self.size * LINE_HEIGHT_EM


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """Straight pieces through points (x, y), with an arrow at its end or not."""

    points: tuple[tuple[float, float], ...]
    arrow: bool = False


Item: TypeAlias = Shape | Text | Line


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A part of a chart, entered at (0, 0) and left at (0, height).

    Attributes:
        left: How far it reaches to the left of its axis; `right` to the right.
        arrow_in: The line that enters it ends there, with an arrow.
        items: What is drawn, from back to front.
    """

    left: float
    right: float
    height: float
    arrow_in: bool = True
    items: tuple[Item, ...] = ()


def moved(items: Iterable[Item], dx: float, dy: float) -> tuple[Item, ...]:
    """The same items elsewhere."""
    return tuple(
        replace(i, points=tuple((x + dx, y + dy) for x, y in i.points))
        if isinstance(i, Line)
        else replace(i, x=i.x + dx, y=i.y + dy)
        for i in items
    )


def lines_of_text(lines: Sequence[tuple[str, str, float]], top: float) -> tuple[tuple[Text, ...], float]:
    """Lines (text, style, size) below one another around the axis, and where they end."""
    texts: list[Text] = []
    for text, style, size in lines:
        texts.append(Text(text=text, style=style, size=size, x=0, y=top))
        top += size * LINE_HEIGHT_EM
    return tuple(texts), top


def box(lines: Sequence[tuple[str, str, float]], style: str, *, inset: float, slant: float = 0.0) -> Block:
    """A shape around lines of text.

    Args:
        inset: Between the shape and the text.
        slant: So much of the shape, left and right, is not there for text: the corners of a hexagon.
    """
    texts, bottom = lines_of_text(lines, inset)
    half = max((t.width for t in texts), default=0.0) / 2 + inset + slant
    shape = Shape(style=style, x=-half, y=0, width=2 * half, height=bottom + inset)
    return Block(left=half, right=half, height=shape.height, items=(shape, *texts))


def stack(blocks: Sequence[Block]) -> Block:
    """One below the other, joined by arrows; of no blocks, a line without length."""
    y, items = 0.0, list[Item]()
    for number, block in enumerate(blocks):
        if number:
            items.append(Line(points=((0, y), (0, y + GAP)), arrow=block.arrow_in))
            y += GAP
        items += moved(block.items, 0, y)
        y += block.height
    return Block(
        left=max((b.left for b in blocks), default=0.0),
        right=max((b.right for b in blocks), default=0.0),
        height=y,
        arrow_in=blocks[0].arrow_in if blocks else False,
        items=tuple(items),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A block that stands beside others, with what is written at the line that leads to it."""

    block: Block
    label: str = ""


def beside(columns: Sequence[Column]) -> tuple[list[float], float, float]:
    """Where the axes of columns are, around a common one in the middle of the outer two; and the extents."""
    axes: list[float] = []
    edge = 0.0
    for column in columns:
        axes.append(edge + column.block.left)
        edge = axes[-1] + max(column.block.right, _label_width(column.label)) + BESIDE
    middle = (axes[0] + axes[-1]) / 2
    return [a - middle for a in axes], middle, edge - BESIDE - middle


def fan(head: Block, columns: Sequence[Column], *, bar: str = "") -> Block:
    """A head, then columns beside one another that come together again below.

    Args:
        bar: Style of the bars at which the columns begin and end; none if empty.
    """
    axes, left, right = beside(columns)
    reach = max(12.0, -axes[0] + 12)
    rail = head.height + 10
    begin = rail + (GAP if any(c.label for c in columns) else 12)
    items: list[Item] = [*head.items, Line(points=((0, head.height), (0, rail)))]
    if bar:
        items.append(Shape(style=bar, x=-reach, y=rail - 2.5, width=2 * reach, height=5))
    elif len(columns) > 1:
        items.append(Line(points=((axes[0], rail), (axes[-1], rail))))
    bottom = begin + max(c.block.height for c in columns)
    for column, x in zip(columns, axes, strict=True):
        items.append(Line(points=((x, rail), (x, begin)), arrow=column.block.arrow_in))
        items += _label(column.label, x, rail)
        items += moved(column.block.items, x, begin)
        items.append(Line(points=((x, begin + column.block.height), (x, bottom + 10))))
    if bar:
        items.append(Shape(style=bar, x=-reach, y=bottom + 7.5, width=2 * reach, height=5))
    elif len(columns) > 1:
        items.append(Line(points=((axes[0], bottom + 10), (axes[-1], bottom + 10))))
    items.append(Line(points=((0, bottom + 10), (0, bottom + 20))))
    return Block(
        left=max(left, head.left, reach if bar else 0.0),
        right=max(right, head.right, reach if bar else 0.0),
        height=bottom + 20,
        arrow_in=head.arrow_in,
        items=tuple(items),
    )


def begun(columns: Sequence[Column]) -> Block:
    """Columns that begin at a bar, each with an end of its own, beside the line that goes on at once."""
    onward = Column(block=Block(left=4, right=4, height=0, arrow_in=False), label="goes on")
    axes, left, right = beside([onward, *columns])
    reach = max(12.0, -axes[0] + 12)
    begin = 12 + GAP
    items: list[Item] = [
        Line(points=((0, 0), (0, 10))),
        Shape(style="bar", x=-reach, y=9.5, width=2 * reach, height=5),
        *_label(onward.label, axes[0], 12),
    ]
    bottom = begin
    for column, x in zip(columns, axes[1:], strict=True):
        end = begin + column.block.height
        items.append(Line(points=((x, 12), (x, begin)), arrow=column.block.arrow_in))
        items += moved(column.block.items, x, begin)
        items.append(Line(points=((x, end), (x, end + 8))))
        items.append(Shape(style="end", x=x - 5, y=end + 8, width=10, height=10))
        bottom = max(bottom, end + 18)
    items.append(Line(points=((axes[0], 12), (axes[0], bottom + 10), (0, bottom + 10), (0, bottom + 20))))
    return Block(left=max(left, reach), right=max(right, reach), height=bottom + 20, arrow_in=False, items=tuple(items))


def repeated_while(head: Block, body: Block) -> Block:
    """A question first; `yes` leads through the body back to it, `no` out."""
    top, gap = 12.0, GAP + 4
    begin = top + head.height + gap
    end = begin + body.height
    left, right = max(head.left, body.left) + 16, max(head.right, body.right, head.right + _label_width("no")) + 16
    middle = top + head.height / 2
    items: list[Item] = [
        Line(points=((0, 0), (0, top)), arrow=True),
        *moved(head.items, 0, top),
        Line(points=((0, top + head.height), (0, begin)), arrow=body.arrow_in),
        *_label("yes", 0, top + head.height),
        *moved(body.items, 0, begin),
        Line(points=((0, end), (0, end + 10), (-left, end + 10), (-left, 2), (0, 2))),
        Line(points=((head.right, middle), (right, middle), (right, end + 22), (0, end + 22), (0, end + 32))),
        *_label("no", head.right, middle),
    ]
    return Block(left=left, right=right, height=end + 32, arrow_in=False, items=tuple(items))


def repeated_until(head: Block, body: Block) -> Block:
    """The body first; then a question: `no` leads back, `yes` out."""
    top = 12.0
    asked = top + body.height + GAP
    middle, end = asked + head.height / 2, asked + head.height
    left = max(head.left + _label_width("no"), body.left) + 16
    items: list[Item] = [
        Line(points=((0, 0), (0, top)), arrow=body.arrow_in),
        *moved(body.items, 0, top),
        Line(points=((0, asked - GAP), (0, asked)), arrow=True),
        *moved(head.items, 0, asked),
        Line(points=((-head.left, middle), (-left, middle), (-left, 2), (0, 2))),
        *_label("no", -head.left - _label_width("no") - 4, middle),
        Line(points=((0, end), (0, end + GAP))),
        *_label("yes", 0, end),
    ]
    right = max(head.right, body.right, _label_width("yes"))
    return Block(left=left, right=right, height=end + GAP, arrow_in=False, items=tuple(items))


def framed(
    title: Sequence[tuple[str, str, float]], body: Block, style: str, *, around: float = 0.0, joined: bool = True
) -> Block:
    """A frame with a title around a block.

    Args:
        around: So much room is left round the frame, for a second line of it.
        joined: A line leads from the title through the block.
    """
    texts, bottom = lines_of_text(title, around + 5)
    bottom += 5
    half = max((t.width for t in texts), default=0.0) / 2
    left, right = max(body.left, half) + PAD, max(body.right, half) + PAD
    begin = bottom + 14
    end = begin + body.height
    items: list[Item] = [
        Shape(style=f"frame {style}", x=-left, y=around, width=left + right, height=end + PAD - around),
        Shape(style=f"title {style}", x=-left, y=around, width=left + right, height=bottom - around),
        *texts,
        *moved(body.items, 0, begin),
    ]
    if joined:
        items.append(Line(points=((0, bottom), (0, begin)), arrow=body.arrow_in))
        items.append(Line(points=((0, end), (0, end + PAD))))
    return Block(left=left + around, right=right + around, height=end + PAD + around, items=tuple(items))


def apart(columns: Sequence[Column]) -> Block:
    """Blocks beside one another that no line joins."""
    axes, left, right = beside(columns)
    items = [i for column, x in zip(columns, axes, strict=True) for i in moved(column.block.items, x, 0)]
    height = max(c.block.height for c in columns)
    return Block(left=left, right=right, height=height, arrow_in=False, items=tuple(items))


def _label(text: str, x: float, y: float) -> list[Item]:
    """Written to the right of a line that begins at (x, y)."""
    if not text:
        return []
    width = text_width(text, LABEL_SIZE)
    return [Text(text=text, style="label", size=LABEL_SIZE, x=x + 4 + width / 2, y=y + 3)]


def _label_width(text: str) -> float:
    return text_width(text, LABEL_SIZE) + 8 if text else 0.0
