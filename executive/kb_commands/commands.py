"""`concertmaster kb ...`: the commands on knowledge, each in a module of its own."""

from __future__ import annotations

import argparse
from typing import Any

from executive.kb_commands.ask import add_ask
from executive.kb_commands.check import add_check
from executive.kb_commands.diff import add_diff
from executive.kb_commands.doc import add_doc
from executive.kb_commands.explain import add_explain
from executive.kb_commands.history import add_history
from executive.kb_commands.imports import add_import
from executive.kb_commands.learn import add_learn
from executive.kb_commands.recipes import add_recipes
from executive.kb_commands.repository import add_repository
from executive.kb_commands.services import add_services
from executive.kb_commands.show import add_show


def add_kb(commands: argparse._SubParsersAction[Any]) -> None:
    """Add `kb` and all that it can do."""
    kb = commands.add_parser("kb", help="work with the knowledge base").add_subparsers(required=True, metavar="COMMAND")
    add_check(kb)
    add_ask(kb)
    add_explain(kb)
    add_show(kb)
    add_services(kb)
    add_doc(kb)
    add_learn(kb)
    add_recipes(kb)
    add_repository(kb)
    add_import(kb)
    add_diff(kb)
    add_history(kb)
