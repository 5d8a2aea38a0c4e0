"""How much room text takes in a picture, without asking a font.

Widths are those of DejaVu Sans, the widest of the sans-serif fonts that browsers fall back to, rounded up, by
classes of characters: what fits by this table fits with Verdana, Arial, Helvetica and the like too.
"""

from __future__ import annotations

import re
import unicodedata

LINE_HEIGHT_EM = 1.3

_NARROW = frozenset("ijlI|.,:;' ")
_SLIM = frozenset('()[]/\\"*frt-_!`')
_WIDE = frozenset("w&#<>=+~^")
_WIDEST = frozenset("mMW@%")
_NARROW_EM, _SLIM_EM, _USUAL_EM, _CAPITAL_EM, _WIDE_EM, _FULL_EM = 0.35, 0.51, 0.65, 0.79, 0.85, 1.03
_OTHER_EM = 1.13
"""Letters with accents, arrows, other scripts."""

_BREAKS = re.compile(r"[^\s]+\s*")
_WORD_ENDS = re.compile(r"(?<=[_.,/-])|(?<=[a-z0-9])(?=[A-Z])")


def text_width(text: str, size: float) -> float:
    """An upper bound of the width of a text.

    Args:
        size: Of the font; the width has the same unit.
    """
    return size * sum(map(_em, text))


def wrap(text: str, size: float, most: float) -> list[str]:
    """Break a text into lines that are at most so wide: at spaces, else within names, else anywhere."""
    lines = [""]
    for word in _pieces(text, size, most):
        if lines[-1] and text_width((lines[-1] + word).rstrip(), size) > most:
            lines.append("")
        lines[-1] += word
    return [line.rstrip() for line in lines]


def _pieces(text: str, size: float, most: float) -> list[str]:
    pieces: list[str] = []
    for word in _BREAKS.findall(text):
        for part in [word] if text_width(word.rstrip(), size) <= most else _WORD_ENDS.split(word):
            while text_width(part.rstrip(), size) > most:
                fitting = next(n for n in range(len(part), 0, -1) if n == 1 or text_width(part[:n], size) <= most)
                pieces.append(part[:fitting])
                part = part[fitting:]
            pieces.append(part)
    return pieces


def _em(character: str) -> float:
    if character in _NARROW:
        return _NARROW_EM
    if character in _SLIM:
        return _SLIM_EM
    if character in _WIDEST:
        return _FULL_EM
    if character in _WIDE:
        return _WIDE_EM
    if unicodedata.combining(character):
        return 0.0
    if not character.isascii():
        return _OTHER_EM
    return _CAPITAL_EM if character.isupper() else _USUAL_EM
