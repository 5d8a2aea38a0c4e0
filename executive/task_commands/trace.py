"""`concertmaster trace`: print a trace, draw it, export it, or do it again."""

from __future__ import annotations

import argparse

from executive.errors import BadRequest
from executive.exit_codes import FAILED, OK
from executive.export import export_mcap
from executive.pictures import draw_gantt, draw_top_view
from executive.replay import first_difference, kept_knowledge
from executive.trace import FleetOpened, narrate, read_trace
from executive.wiring import site_map
from kb.files import SHIPPED
from kb.store import KnowledgeBase


def trace(options: argparse.Namespace) -> int:
    """Do what the options say; the exit status."""
    events = list(read_trace(options.file))
    if options.gantt:
        draw_gantt(events, options.gantt)
        print(options.gantt)
    opened = next((e for e in events if isinstance(e, FleetOpened)), None)
    beside = options.file.parent
    folder = options.knowledge or (opened and kept_knowledge(beside, opened.knowledge)) or SHIPPED
    if options.top_view:
        if opened is None:
            raise BadRequest("file", f"{options.file} does not tell the site, so its map is not known")
        knowledge = KnowledgeBase(opened.site, folder)
        draw_top_view(events, site_map(knowledge.snapshot()), options.top_view)
        knowledge.close()
        print(options.top_view)
    if options.mcap:
        export_mcap(events, options.mcap)
        print(options.mcap)
    if options.replay:
        difference = first_difference(events, folder, beside)
        print(difference or f"{len(events)} events, all the same")
        return FAILED if difference else OK
    if not options.gantt and not options.top_view and not options.mcap:
        for line in narrate(events):
            print(line)
    return OK
