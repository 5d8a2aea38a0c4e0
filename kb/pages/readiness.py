"""Readiness of robots for tasks, as data and as a page of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kb.derivation import Derivation, Reason
from kb.pages.rendering import Renderer
from kb.readiness import Readiness
from kb.store import Snapshot


def readiness_data(snapshot: Snapshot, found: Sequence[Readiness]) -> list[dict[str, Any]]:
    """One object for each robot and task; `requires` holds why each capability is there, or is not."""
    derivation = Derivation(snapshot.ontology)
    return [
        {
            "robot": r.who,
            "is_class": r.is_class,
            "task": r.task,
            "role": r.role,
            "verdict": str(r.verdict),
            "through": list(r.through),
            "lacks": [
                {"kind": str(k.kind), "what": k.what, "processes": list(k.processes), "text": k.text} for k in r.lacks
            ],
            "requires": [
                {
                    "capability": capability,
                    "processes": list(processes),
                    "because": _reason(derivation.capability(r.who, capability)),
                }
                for capability, processes in r.requires.items()
            ],
        }
        for r in found
    ]


def _reason(reason: Reason) -> dict[str, Any]:
    place = reason.place
    where = {} if place is None else {"file": place.file.name, "line": place.line}
    return {"text": reason.text, "holds": reason.holds, **where, "because": [_reason(r) for r in reason.because]}


def readiness_page(snapshot: Snapshot, found: Sequence[Readiness]) -> str:
    """An HTML document that needs nothing else."""
    renderer = Renderer(f"{snapshot.site}: readiness", None, None)
    derivation = Derivation(snapshot.ontology)
    reasons = [[(c, p, derivation.capability(r.who, c)) for c, p in r.requires.items()] for r in found]
    return renderer.render(
        "readiness.html", "", **matrix_values(found), detailed=list(zip(found, reasons, strict=True))
    )


def matrix_values(found: Sequence[Readiness]) -> dict[str, Any]:
    """What the matrix in templates/parts.html takes."""
    return {
        "robots": list(dict.fromkeys(r.who for r in found)),
        "tasks": list(dict.fromkeys(r.task for r in found)),
        "cells": {(r.who, r.task): r for r in found},
    }
