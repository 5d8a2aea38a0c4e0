"""Frames of rosbridge v2: texts of JSON or bytes of CBOR, from and to operations.

`frames` writes an operation as a subscriber asked for: in JSON, in CBOR, as a PNG image, in fragments. A `Decoder` for
each connection takes any text or bytes, puts fragments together and opens images; it gives operations or raises
BadFrame or BadOperation, nothing else. No sockets, no clock: times are given.
"""

from __future__ import annotations

from grounding.rosbridge.encoding import BadFrame, Limits, cbor_of, json_of, read_frame
from grounding.rosbridge.fragments import Reassembler, split
from grounding.rosbridge.images import png_of, text_of_png
from grounding.rosbridge.operations import Fragment, Operation, Png, read

__all__ = [
    "BadFrame",
    "Decoder",
    "Limits",
    "Reassembler",
    "frames",
    "png_of",
    "raw_message",
    "read_frame",
    "split",
    "text_of_png",
]


def frames(
    operation: Operation,
    *,
    compression: str = "none",
    fragment_size: int | None = None,
    fragment_id: str | int = "frame",
) -> list[str | bytes]:
    """The frames that carry an operation.

    Args:
        compression: none, png, cbor or cbor-raw; the last two are written alike, see `raw_message`.
        fragment_size: Longest text in characters that is sent in one piece; None if there is no limit. Bytes of CBOR
            are always sent in one piece, as the protocol has no fragments of bytes.
        fragment_id: Of the fragments, if the operation has no id.

    Raises:
        BadFrame: The operation holds what the encoding has no words for.
    """
    if compression in ("cbor", "cbor-raw"):
        return [cbor_of(operation)]
    text = json_of(operation)
    if compression == "png":
        text = json_of(Png(data=png_of(text)))
    if fragment_size is None or len(text) <= fragment_size:
        return [text]
    given_id = getattr(operation, "id", None)
    return [json_of(part) for part in split(text, fragment_size, fragment_id if given_id is None else given_id)]


def raw_message(data: bytes | memoryview, now_s: float) -> dict[str, object]:
    """What stands for a message under the compression cbor-raw: its serialized bytes and when they came."""
    secs, nsecs = divmod(round(now_s * 1e9), 1_000_000_000)
    return {"secs": secs, "nsecs": nsecs, "bytes": bytes(data)}


class Decoder:
    """From the frames of one connection to operations."""

    def __init__(self, limits: Limits = Limits()) -> None:  # noqa: B008 - it is frozen
        self._limits = limits
        self._reassembler = Reassembler(limits)

    def feed(self, frame: str | bytes, now_s: float) -> Operation | None:
        """Take a frame.

        Returns:
            The operation that it holds or completes, never Fragment or Png; None if further fragments are needed.

        Raises:
            BadFrame: It cannot be read.
            BadOperation: Its fields are no operation.
        """
        operation = read(read_frame(frame, self._limits))
        inside: set[str] = set()
        while isinstance(operation, Fragment | Png):
            if operation.OP in inside:
                raise BadFrame(f"a {operation.OP} inside a {operation.OP}")
            inside.add(operation.OP)
            text = self._reassembler.add(operation, now_s)
            if text is None:
                return None
            if isinstance(operation, Png):
                text = text_of_png(text, self._limits)
            operation = read(read_frame(text, self._limits))
        return operation
