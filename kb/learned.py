"""What was learned of a site: `learned.owl` beside the site's file, to be read, reviewed, taken away.

The file imports that of the site and adds to it how long processes were found to take, how often they succeed,
how fast robots travel; and, as individuals of LearnedValue, where a single robot differs, everywhere or at a
place. People's own files are never changed. Where `learned.owl` exists, the site is read through it;
kb/ontology.py then takes what was learned of processes and robots in place of what is stated, kb/compiler.py
what was learned of single robots.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from kb.editing import write_over
from kb.files import local_name, read_files
from kb.ontology import LEARNED
from kb.vocabulary import CORE, Kind, Property
from kb.writing import Entity, Sort, ontology_text

FILE = "learned.owl"


@dataclass(frozen=True, slots=True, kw_only=True)
class Refinement:
    """A number that was learned.

    Attributes:
        prop: What it stands in for: duration_s, successOdds or travelFactor.
        subject: Process or robot, by IRI.
        value: Seconds, probability or factor.
        source: How much was measured, in a sentence.
        robot: By IRI: of a process, the robot that it is about; empty if it is about all.
        place: By IRI: where; empty if everywhere.
    """

    prop: Property
    subject: str
    value: float
    source: str
    robot: str = ""
    place: str = ""


def site_file(folder: Path, site: str) -> Path:
    """The file that people have written for a site."""
    return folder / "sites" / site / f"{site}.owl"


def learned_file(folder: Path, site: str) -> Path:
    """Where what was learned of a site is, if anything was."""
    return folder / "sites" / site / FILE


def main_file(folder: Path, site: str) -> Path:
    """Where to begin to read a site: what was learned, which imports the rest; else the site's own file."""
    learned = learned_file(folder, site)
    return learned if learned.exists() else site_file(folder, site)


def write_learned(folder: Path, site: str, refinements: Iterable[Refinement]) -> Path:
    """Write what was learned of a site over what was before; the same refinements make the same file.

    Raises:
        OntologyRejected: The site's file does not parse, or what it imports is not there.
    """
    site_iri = read_files(site_file(folder, site), folder).files[-1].iri
    file = learned_file(folder, site)
    write_over(file, _text(site_iri, refinements).encode("utf-8"))
    return file


def forget_learned(folder: Path, site: str) -> bool:
    """Take away what was learned; what is stated holds again. False if there was nothing."""
    file = learned_file(folder, site)
    if not file.exists():
        return False
    file.unlink()
    return True


def _text(site_iri: str, refinements: Iterable[Refinement]) -> str:
    iri = f"{site_iri.removesuffix('.owl')}_learned.owl"
    found: dict[tuple[str, str, str], list[Refinement]] = {}
    for refinement in sorted(refinements, key=lambda r: r.prop):
        found.setdefault((refinement.subject, refinement.robot, refinement.place), []).append(refinement)
    entities = [
        Entity(
            iri=_individual(iri, subject, robot, place) if robot else subject,
            sort=Sort.INDIVIDUAL,
            types=(CORE + Kind.LEARNED_VALUE,) if robot else (),
            links=tuple(
                (CORE + prop, linked)
                for prop, linked in (
                    (Property.OF_PROCESS, subject),
                    (Property.OF_ROBOT, robot),
                    (Property.AT_PLACE, place),
                )
                if robot and linked
            ),
            values=(
                *((CORE + LEARNED[r.prop], r.value) for r in own),
                *((CORE + Property.LEARNED_FROM, f"{LEARNED[r.prop]}: {r.source}") for r in own),
            ),
        )
        for (subject, robot, place), own in found.items()
    ]
    comment = "Learned where robots worked. A value stands in for the one that is stated; to undo it, delete it."
    return ontology_text(iri, entities, imports=[site_iri], comments=[comment], label="learned")


def _individual(iri: str, process: str, robot: str, place: str) -> str:
    """The IRI of what is learned of a robot: `Kinect_by_pico_1_at_bar`."""
    at = f"_at_{local_name(place)}" if place else ""
    return f"{iri}#{local_name(process)}_by_{local_name(robot)}{at}"
