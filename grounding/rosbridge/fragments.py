"""Texts in pieces: cut into fragments, and put together again within limits."""

from __future__ import annotations

from dataclasses import dataclass, field

from grounding.rosbridge.encoding import BadFrame, Limits
from grounding.rosbridge.operations import Fragment, Png
from grounding.rosbridge.wording import shown


def split(text: str, size: int, fragment_id: str | int) -> list[Fragment]:
    """A text in fragments of at most `size` characters."""
    pieces = [text[start : start + size] for start in range(0, len(text), size)] or [""]
    return [Fragment(id=fragment_id, data=piece, num=num, total=len(pieces)) for num, piece in enumerate(pieces)]


@dataclass(slots=True, kw_only=True)
class _Parts:
    """A text of which some parts have come."""

    total: int
    by_num: dict[int, str] = field(default_factory=dict)
    characters: int = 0
    changed_s: float


class Reassembler:
    """Puts fragments, and parts of images, together; for one connection."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._unfinished: dict[tuple[str, str | int], _Parts] = {}

    def add(self, part: Fragment | Png, now_s: float) -> str | None:
        """Take a part.

        Returns:
            The whole text if it was the last part, else None.

        Raises:
            BadFrame: It does not fit to the other parts, or is too much; what there is of the text is thrown away.
        """
        if part.num is None or part.total is None or part.id is None:
            return part.data
        self._forget_old(now_s)
        key = (part.OP, part.id)
        parts = self._unfinished.pop(key, None) or _Parts(total=part.total, changed_s=now_s)
        if part.total != parts.total:
            raise BadFrame(f"{part.OP} {shown(part.id)} has total {part.total}, was {parts.total} before")
        if parts.by_num.get(part.num, part.data) != part.data:
            raise BadFrame(f"{part.OP} {shown(part.id)} has two different parts {part.num}")
        if part.num not in parts.by_num:
            self._check_room(part, parts)
            parts.by_num[part.num] = part.data
            parts.characters += len(part.data)
        parts.changed_s = now_s
        if len(parts.by_num) == parts.total:
            return "".join(parts.by_num[num] for num in range(parts.total))
        self._unfinished[key] = parts
        return None

    @property
    def unfinished(self) -> int:
        """How many texts wait for parts."""
        return len(self._unfinished)

    def _check_room(self, part: Fragment | Png, parts: _Parts) -> None:
        limits = self._limits
        waiting = [*self._unfinished.values(), parts]
        if len(waiting) > limits.max_unfinished:
            raise BadFrame(f"{limits.max_unfinished} fragmented texts are unfinished, finish one before the next")
        if parts.total > limits.max_fragments or sum(len(p.by_num) for p in waiting) >= limits.max_fragments:
            raise BadFrame(f"{part.OP} {shown(part.id)} makes more than {limits.max_fragments} fragments")
        size = len(part.data) + sum(p.characters for p in waiting)
        if size > limits.max_bytes:
            raise BadFrame(f"unfinished fragments hold {size} bytes, {limits.max_bytes} are allowed")

    def _forget_old(self, now_s: float) -> None:
        oldest_s = now_s - self._limits.fragment_timeout_s
        self._unfinished = {key: parts for key, parts in self._unfinished.items() if parts.changed_s >= oldest_s}
