"""JSON texts in PNG images, as rosbridge's compression `png` has them."""

from __future__ import annotations

import base64
import binascii
import io
import json
import math
import re

from PIL import Image

from grounding.rosbridge.encoding import BadFrame, Limits

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_NOT_ASCII = re.compile(r"[^\x00-\x7f]")


def png_of(text: str) -> str:
    """A JSON text as base64 of a PNG image whose RGB bytes are its characters, padded with line ends.

    Readers take each byte for a character, so that other characters than ASCII are escaped.
    """
    data = _NOT_ASCII.sub(lambda match: json.dumps(match[0])[1:-1], text).encode("ascii")
    width = max(1, math.isqrt(len(data) // 3))
    height = max(1, math.ceil(len(data) / (3 * width)))
    image = Image.frombytes("RGB", (width, height), data.ljust(3 * width * height, b"\n"))
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    return base64.b64encode(buffer.getbuffer()).decode("ascii")


def text_of_png(data: str, limits: Limits = Limits()) -> str:  # noqa: B008 - it is frozen
    """The text in a PNG image, the inverse of `png_of`.

    Raises:
        BadFrame: It is no base64 of a PNG image in RGB, or larger than allowed.
    """
    try:
        image_bytes = base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError) as error:
        raise BadFrame(f"the data of png are no base64: {error}") from None
    # The size stands in the first chunk: it is known before anything is unpacked.
    if len(image_bytes) < 24 or image_bytes[:8] != _PNG_SIGNATURE or image_bytes[12:16] != b"IHDR":
        raise BadFrame("the data of png are no PNG image")
    width, height = (int.from_bytes(image_bytes[at : at + 4], "big") for at in (16, 20))
    if 3 * width * height > limits.max_bytes:
        raise BadFrame(f"the image of png holds {3 * width * height} bytes, {limits.max_bytes} are allowed")
    try:
        with Image.open(io.BytesIO(image_bytes), formats=["PNG"]) as image:
            if image.mode != "RGB":
                raise BadFrame(f"the image of png has mode {image.mode}, should be RGB")
            return image.tobytes().decode("utf-8").rstrip("\n")
    except BadFrame:
        raise
    except Exception as error:  # noqa: BLE001 - whatever Pillow says, the image is broken
        raise BadFrame(f"the data of png cannot be read: {error}") from None
