"""Exports a trace as MCAP, for Foxglove and other readers: one channel a kind of event, messages in JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, get_args, get_type_hints

from mcap.writer import Writer

from executive.trace import TraceEvent, to_json

_NS_PER_S = 1_000_000_000
_JSON_TYPES: dict[Any, str] = {str: "string", float: "number", int: "integer", bool: "boolean"}


def export_mcap(events: Sequence[TraceEvent], path: Path) -> None:
    """Write events to an MCAP file; log time is the time of the event."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="concertmaster")
        channels: dict[str, int] = {}
        for number, event in enumerate(events):
            if event.kind not in channels:
                schema = json.dumps(_schema(type(event))).encode()
                schema_id = writer.register_schema(name=event.kind, encoding="jsonschema", data=schema)
                topic = f"/concertmaster/{event.kind}"
                channels[event.kind] = writer.register_channel(
                    topic=topic, message_encoding="json", schema_id=schema_id
                )
            time_ns = round(event.t_s * _NS_PER_S)
            writer.add_message(
                channel_id=channels[event.kind],
                log_time=time_ns,
                publish_time=time_ns,
                sequence=number,
                data=to_json(event).encode(),
            )
        writer.finish()


def _schema(kind: type[TraceEvent]) -> dict[str, Any]:
    hints = get_type_hints(kind)
    properties = {field.name: _json_type(hints[field.name]) for field in fields(kind)}
    return {"type": "object", "title": kind.kind, "properties": {"kind": {"type": "string"}, **properties}}


def _json_type(hint: Any) -> dict[str, Any]:
    if hint in _JSON_TYPES:
        return {"type": _JSON_TYPES[hint]}
    origin = getattr(hint, "__origin__", None)
    if origin is list:
        return {"type": "array", "items": _json_type(get_args(hint)[0])}
    return {"type": "object"} if origin is dict else {}
