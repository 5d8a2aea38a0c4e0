from __future__ import annotations

import base64
import contextlib
import io
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from grounding.rosbridge.encoding import BadFrame, Limits, read_frame
from grounding.rosbridge.framing import frames
from grounding.rosbridge.images import png_of, text_of_png
from grounding.rosbridge.operations import Publish

_SMALL = Limits(max_bytes=2_000, max_depth=8, max_items=100, max_objects=50, max_unfinished=2, max_fragments=10)


@settings(deadline=None, derandomize=True)
@given(st.text())
def test_a_text_comes_out_of_the_image_it_went_into(text: str) -> None:
    """Any JSON text, but for the line ends with which the image is filled up."""
    (wrapped,) = frames(Publish(topic="/a", msg={"t": text}))
    assert isinstance(wrapped, str)
    assert read_frame(text_of_png(png_of(wrapped))) == read_frame(wrapped)


def test_images_hold_ascii_only() -> None:
    """Clients in browsers take each byte of the image for one character."""
    image = Image.open(io.BytesIO(base64.b64decode(png_of('{"a":"ü😀"}'))))
    assert image.mode == "RGB"
    assert image.tobytes().rstrip(b"\n") == b'{"a":"\\u00fc\\ud83d\\ude00"}'


def _png(mode: str, size: tuple[int, int] = (4, 4)) -> str:
    buffer = io.BytesIO()
    Image.new(mode, size).save(buffer, "PNG")
    return base64.b64encode(buffer.getvalue()).decode()


def _claiming(width: int, height: int) -> str:
    """An image whose head claims a size that its body does not have."""
    head = b"IHDR" + width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x02\x00\x00\x00"
    chunk = len(head[4:]).to_bytes(4, "big") + head + zlib.crc32(head).to_bytes(4, "big")
    return base64.b64encode(b"\x89PNG\r\n\x1a\n" + chunk).decode()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        ("!", "no base64"),
        ("ü", "no base64"),
        ("", "no PNG image"),
        ("AAAA" * 20, "no PNG image"),
        (_png("L"), "has mode L, should be RGB"),
        (_png("RGBA"), "has mode RGBA, should be RGB"),
        (_png("RGB", (30, 30)), "holds 2700 bytes, 2000 are allowed"),
        (_claiming(100_000, 100_000), "holds 30000000000 bytes"),
        (_claiming(4, 4), "cannot be read"),
        (_claiming(0, 0), "cannot be read"),
        (_png("RGB")[:60] + "AAAA" + _png("RGB")[64:], "cannot be read|is no JSON"),
    ],
)
def test_bad_images_are_told(data: str, reason: str) -> None:
    """No image, one of another kind, one that is too large unpacked, one that is broken."""
    with pytest.raises(BadFrame, match=reason):
        text_of_png(data, _SMALL)


@settings(deadline=None, derandomize=True)
@given(st.binary(max_size=80))
def test_any_bytes_after_the_head_of_an_image_are_a_text_or_a_reason(rest: bytes) -> None:
    """Nothing but BadFrame comes out of an image."""
    start = base64.b64decode(_png("RGB"))[:33]
    with contextlib.suppress(BadFrame):
        text_of_png(base64.b64encode(start + rest).decode(), _SMALL)
