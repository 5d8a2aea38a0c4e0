"""From the files of a site to what a fleet needs, or to all that is wrong with them.

The one way for whoever loads, checks or watches. A stage runs wherever it does not depend on what an earlier one
found wrong, so that a person is told as much as can be told at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from kb import validation
from kb.compiler import Compiler
from kb.files import FilesRejected, read_files, unused_files
from kb.groundings import Grounding, TravelEstimate, read_groundings, read_travel_estimates
from kb.learned import main_file
from kb.ontology import Ontology, close
from kb.problems import OntologyRejected, Problem, errors, in_order, reject_errors
from kb.processes import Process, read_processes
from kb.reachability import unreachable
from kb.reasoner import begin_to_classify
from kb.sites import check_site, sites_of
from kb.terms import Term


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """A site whose files can be used.

    Attributes:
        facts: What the planner is given, for the revision asked for.
        warnings: What is probably not meant, in order of file and line.
    """

    ontology: Ontology
    processes: Mapping[str, Process]
    groundings: Mapping[str, Grounding]
    travel_estimates: tuple[TravelEstimate, ...]
    compiler: Compiler
    facts: list[Term]
    warnings: tuple[Problem, ...]


def check_folder(folder: Path) -> list[Problem]:
    """Warnings of ontology files that no site of a folder reads."""
    return unused_files(folder, [main_file(folder, site) for site in sites_of(folder)])


def check_ontology(path: Path, folder: Path) -> tuple[Ontology | None, list[Problem]]:
    """An ontology file and its imports, and what is wrong with them.

    Returns:
        No ontology where files do not parse, terms are misspelt, or the reasoner finds a contradiction.
    """
    try:
        files = read_files(path, folder)
    except FilesRejected as rejected:
        return None, [*rejected.problems, *validation.check_parts(rejected.files)]
    classification = begin_to_classify(files)  # beside the checks below
    problems = validation.check(files)
    if any(p.code in validation.MISLEADING for p in errors(problems)):
        return None, problems
    try:
        return close(files, classification()), problems
    except OntologyRejected as rejected:
        return None, [*problems, *rejected.problems]


def read_site(path: Path, folder: Path, revision: int) -> Checked:
    """Read the file of a site and all that it imports.

    Args:
        revision: Whose facts they will be.

    Raises:
        OntologyRejected: With everything that is wrong.
    """
    ontology, problems = check_ontology(path, folder)
    if ontology is None or not validation.processes_are_whole(problems):
        raise OntologyRejected(problems)
    try:
        processes = read_processes(ontology)
    except OntologyRejected as rejected:
        raise OntologyRejected([*problems, *rejected.problems]) from rejected
    groundings = read_groundings(ontology, processes, path.parent)
    estimates = read_travel_estimates(ontology, path.parent)
    problems += check_site(ontology, processes, groundings, estimates)
    compiler = Compiler(ontology, processes)
    try:
        facts = compiler.facts(revision)
    except OntologyRejected as rejected:
        raise OntologyRejected([*problems, *rejected.problems]) from rejected
    problems += [*compiler.warnings, *unreachable(ontology, processes, facts)]
    reject_errors(problems)
    return Checked(
        ontology=ontology,
        processes=processes,
        groundings=groundings,
        travel_estimates=tuple(sorted(set(estimates.values()), key=str)),
        compiler=compiler,
        facts=facts,
        warnings=tuple(in_order(problems)),
    )
