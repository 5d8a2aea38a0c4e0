"""Small ontologies for the repository: a way to beep, a robot that can, a room."""

from __future__ import annotations

from collections.abc import Iterable

from kb.vocabulary import CORE, CORE_IRI
from kb.writing import Entity, Literal, Sort, ontology_text

IRI = "http://example.org/made/"


def individual(
    file: str, name: str, kind: str, links: Iterable[tuple[str, str]] = (), values: Iterable[tuple[str, Literal]] = ()
) -> Entity:
    """An individual of a file; links are to IRIs, or to names in the same file."""
    own = f"{IRI}{file}.owl#"
    return Entity(
        iri=own + name,
        sort=Sort.INDIVIDUAL,
        types=(CORE + kind,),
        links=tuple((CORE + p, to if ":" in to else own + to) for p, to in links),
        values=tuple((CORE + p, v) for p, v in values),
    )


def text(file: str, entities: Iterable[Entity], *imports: str, comment: str = "") -> str:
    """An ontology file that imports the core, and others by name."""
    wanted = [CORE_IRI, *(f"{IRI}{name}.owl" for name in imports)]
    return ontology_text(f"{IRI}{file}.owl", entities, imports=wanted, comments=[comment] if comment else [])


def beeps() -> str:
    """An atomic process of robots with a Kinect; who grounds it is left to a site."""
    robot = individual(
        "beeps",
        "Beep_robot",
        "RobotParameter",
        [("parameterType", CORE + "Robot")],
        [("parameterName", "robot"), ("parameterNumber", 10)],
    )
    beep = individual(
        "beeps",
        "Beep",
        "AtomicProcess",
        [("hasInput", "Beep_robot"), ("requiresCapability", CORE + "RobotWithKinect")],
        [("duration_s", 0.5)],
    )
    return text("beeps", [beep, robot], comment="How a robot makes itself heard.")


def song(name: str, steps: int) -> str:
    """A composite process of beeps, in a file of its own that imports the beeps."""
    file = name.lower()
    robot = individual(
        file,
        f"{name}_robot",
        "RobotParameter",
        [("parameterType", CORE + "Robot")],
        [("parameterName", "robot"), ("parameterNumber", 10)],
    )
    performed = [
        individual(file, f"{name}_{n}", "Perform", [("performs", f"{IRI}beeps.owl#Beep")], [("stepNumber", 10 * n)])
        for n in range(1, steps + 1)
    ]
    body = individual(file, f"{name}_body", "Sequence", [("hasStep", f"{name}_{n}") for n in range(1, steps + 1)])
    whole = individual(file, name, "CompositeProcess", [("hasInput", f"{name}_robot"), ("composedOf", f"{name}_body")])
    return text(file, [whole, robot, body, *performed], "beeps", comment=f"Beep {steps} times, for a welcome.")
