"""`concertmaster kb doc`: a browsable reference of a knowledge base."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from executive.errors import BadRequest
from executive.exit_codes import OK
from executive.kb_commands.options import add_site
from kb.pages.reference import reference
from kb.store import KnowledgeBase


def add_doc(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    doc = commands.add_parser("doc", help="write a browsable reference of the knowledge base, as HTML")
    add_site(doc)
    doc.add_argument("--out", type=Path, required=True, metavar="DIR", help="the folder to write it into")
    doc.set_defaults(command=_doc)


def _doc(options: argparse.Namespace) -> int:
    out: Path = options.out
    if out.exists() and not out.is_dir():
        raise BadRequest("out", f"--out {out} is a file; give a folder")
    knowledge = KnowledgeBase(options.site, options.knowledge)
    snapshot = knowledge.snapshot()
    knowledge.close()
    pages = reference(snapshot, knowledge.warnings, options.knowledge)
    for name, text in pages.items():
        path = out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    print(f"{out / 'index.html'}: {len(pages)} pages")
    return OK
