"""`concertmaster kb learn`: better durations, odds and travel factors from traces, to review and accept."""

from __future__ import annotations

import argparse
import hashlib
import os
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from executive.errors import BadRequest
from executive.exit_codes import OK, complain
from executive.experience import gather
from executive.kb_commands.options import add_site
from executive.trace import FleetOpened, read_trace
from kb.checking import read_site
from kb.errors import ConcertmasterError
from kb.experience import Experience, Tries
from kb.files import SHIPPED
from kb.learned import Refinement, forget_learned, learned_file, main_file, site_file, write_learned
from kb.learned_values import learned_values, one_try
from kb.ontology import Ontology
from kb.user_folders import data_folder
from kb.vocabulary import Property

if TYPE_CHECKING:
    from kb.learning import Lesson

_ANY_REVISION = 0


def add_learn(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    learn = commands.add_parser("learn", help="learn durations and odds from traces; nothing changes until accepted")
    learn.add_argument("traces", nargs="*", type=Path, metavar="trace", help="a trace.jsonl that `run` wrote")
    add_site(learn)
    learn.add_argument(
        "--experience", type=Path, help="file of what was measured (default: in the user's data, for all sites)"
    )
    learn.add_argument("--by", choices=["robot", "place"], help="also tell what was measured by robot, or by place")
    decide = learn.add_mutually_exclusive_group()
    decide.add_argument("--accept", action="store_true", help="write what differs to learned.owl, beside the site")
    decide.add_argument("--revert", action="store_true", help="take learned.owl away: what is stated holds again")
    learn.set_defaults(command=_learn)


def _learn(options: argparse.Namespace) -> int:
    from kb.learning import learn  # noqa: PLC0415 - scipy takes a while, and only this command needs it

    folder, site = options.knowledge, options.site
    if options.revert:
        gone = forget_learned(folder, site)
        print(f"{learned_file(folder, site)} {'is gone' if gone else 'was not there'}; what is stated holds")
        return OK
    if options.accept and folder.resolve().is_relative_to(SHIPPED):
        raise BadRequest(
            "knowledge", f"{folder} is shipped, and not changed; copy it, and give the copy by --knowledge"
        )
    stated = read_site(site_file(folder, site), folder, _ANY_REVISION).ontology
    used = read_site(main_file(folder, site), folder, _ANY_REVISION).ontology
    experience = Experience(options.experience or data_folder(os.environ) / "experience.sqlite")
    for trace in options.traces:
        _take_in(trace, site, experience, stated, used)
    tries, trips = experience.tries(site), experience.trips(site)
    print(f"{site}: {experience.traces(site)} traces, {sum(t.count for t in tries)} tries, {len(trips)} trips")
    lessons = [lesson for lesson in learn(tries, trips, stated) if lesson.differs]
    rows = [
        (
            *(_of(lesson), str(lesson.prop), f"{lesson.stated:.4g}"),
            f"{_in_use(lesson, used):.4g}",
            *(f"{lesson.learned:.4g}", str(lesson.tries), f"{lesson.low:.4g} .. {lesson.high:.4g}"),
        )
        for lesson in lessons
    ]
    if rows:
        _print_table(("of", "property", "otherwise", "in use", "learned", "tries", "99 percent between"), rows)
    else:
        print("nothing differs from what is stated")
    if options.by:
        _print_table(("process", options.by, "tries", "succeeded", "mean (s)"), _by(options.by, tries))
    if options.accept:
        _accept(folder, site, [_refinement(lesson, stated) for lesson in lessons])
    return OK


def _of(lesson: Lesson) -> str:
    """What a lesson is about: `Kinect`, `Kinect by pico_1`, `Kinect by pico_1 at at_bar`."""
    by = f" by {lesson.robot}" if lesson.robot else ""
    return lesson.subject + by + (f" at {lesson.place}" if lesson.place else "")


def _refinement(lesson: Lesson, stated: Ontology) -> Refinement:
    return Refinement(
        prop=lesson.prop,
        subject=stated.iri(lesson.subject),
        value=lesson.learned,
        source=lesson.source,
        robot=stated.iri(lesson.robot) if lesson.robot else "",
        place=stated.iri(lesson.place) if lesson.place else "",
    )


def _in_use(lesson: Lesson, used: Ontology) -> float:
    """What plans are made with now: stated, or learned and accepted before."""
    if lesson.prop in (Property.TRAVEL_FACTOR, Property.RECOVERY_ODDS):
        number = used.value(lesson.prop, lesson.subject)
        return float(number) if isinstance(number, int | float) else 1.0
    learned = learned_values(used).get((lesson.subject, lesson.robot), []) if lesson.robot else []
    duration_s, odds = one_try(used, lesson.subject, learned, lesson.place)
    return duration_s if lesson.prop == Property.DURATION_S else odds


def _take_in(trace: Path, site: str, experience: Experience, stated: Ontology, used: Ontology) -> None:
    events = list(read_trace(trace))
    opened = next((e for e in events if isinstance(e, FleetOpened)), None)
    if opened is None or opened.site != site:
        told = f"is of {opened.site}" if opened else "does not tell its site"
        raise BadRequest("traces", f"{trace} {told}; give traces of {site}, or the other site by --site")
    own = next((o for o in (used, stated) if o.files.digest == opened.knowledge), None)
    if own is None:
        complain(f"{trace}: its run had other knowledge, so its plans do not tell how long ways were estimated to be")
    gathered = gather(events, own or stated, same_knowledge=own is not None)
    digest = hashlib.sha256(trace.read_bytes()).hexdigest()
    if not experience.add(digest, site, gathered.tries, gathered.trips):
        complain(f"{trace}: was taken in before, and counts once")


def _accept(folder: Path, site: str, learned: Sequence[Refinement]) -> None:
    """Write what was learned; where the knowledge would be wrong with it, it stays as it was."""
    file = learned_file(folder, site)
    before = file.read_bytes() if file.exists() else None
    if not learned:
        forget_learned(folder, site)
        return
    write_learned(folder, site, learned)
    try:
        read_site(main_file(folder, site), folder, _ANY_REVISION)
    except ConcertmasterError:
        if before is None:
            forget_learned(folder, site)
        else:
            file.write_bytes(before)
        raise
    print(f"accepted: {file}")


def _by(what: str, tries: Iterable[Tries]) -> list[tuple[str, ...]]:
    groups: dict[tuple[str, str], list[Tries]] = defaultdict(list)
    for t in tries:
        if key := getattr(t, what):
            groups[t.process, key].append(t)
    rows: list[tuple[str, ...]] = []
    for (process, key), group in sorted(groups.items()):
        count, succeeded = sum(t.count for t in group), sum(t.count for t in group if t.succeeded)
        mean_s = sum(t.count * t.took_ms for t in group) / count / 1000
        rows.append((process, key, str(count), str(succeeded), f"{mean_s:.4g}"))
    return rows


def _print_table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    for row in (head, *rows):
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
