"""A task type, to see a drink, and a recipe for it that takes longer than it need."""

from __future__ import annotations

from pathlib import Path

from kb.vocabulary import CORE
from kb.writing import Entity, Literal, Sort, ontology_text

_IRI = "http://example.org/concertmaster/"
_DRINK = f"{_IRI}objects.owl#Drink"


def write_see_drink(folder: Path, *, file: str = "see_drink", recipe: str = "LookTwice", looks: int = 2) -> Path:
    """Write a recipe that searches the drink so many times, and, in the first file, the task type SeeDrink."""
    own = f"{_IRI}{file}.owl#"
    task = f"{_IRI}see_drink.owl#SeeDrink"

    def individual(
        name: str, kind: str, links: tuple[tuple[str, str], ...] = (), values: tuple[tuple[str, Literal], ...] = ()
    ) -> Entity:
        return Entity(
            iri=own + name,
            sort=Sort.INDIVIDUAL,
            types=(CORE + kind,),
            links=tuple((CORE + p, to if ":" in to else own + to) for p, to in links),
            values=tuple((CORE + p, v) for p, v in values),
        )

    def parameter(owner: str, role: str, name: str, kind: str, number: int) -> Entity:
        values = (("parameterName", name), ("parameterNumber", number))
        return individual(f"{owner}_{name}", role, (("parameterType", kind),), values)

    entities = [parameter(recipe, "Input", "drink", _DRINK, 10)]
    links = [("realizes", task), ("hasInput", f"{recipe}_drink"), ("composedOf", f"{recipe}_pick_robot")]
    picked = (("robot", "Robot"), ("area", "Area"), ("location", "SearchLocation"))
    for number, (name, kind) in enumerate(picked, start=1):
        entities.append(parameter(recipe, "Local", name, CORE + kind, 10 + 10 * number))
        inner = f"{recipe}_pick_{picked[number][0]}" if number < len(picked) else f"{recipe}_body"
        over = (("overParameter", f"{recipe}_{name}"), ("bodyStep", inner))
        entities.append(individual(f"{recipe}_pick_{name}", "Pick", over))
        links.append(("hasLocal", f"{recipe}_{name}"))
    steps = [f"{recipe}_{number}" for number in range(1, looks + 1)]
    entities += [
        individual(recipe, "CompositeProcess", tuple(links)),
        individual(f"{recipe}_body", "Sequence", tuple(("hasStep", step) for step in steps)),
    ]
    search = (("performs", f"{_IRI}find_empty_drink.owl#SearchDrink"),)
    entities += [individual(s, "Perform", search, (("stepNumber", 10 * n),)) for n, s in enumerate(steps, start=1)]
    if file == "see_drink":
        entities.append(individual("SeeDrink", "SimpleProcess", (("hasInput", "SeeDrink_drink"),)))
        entities.append(parameter("SeeDrink", "Input", "drink", _DRINK, 10))
    imports = {"core", "find_empty_drink", "objects", "see_drink"} - {file}
    path = folder / "tasks" / f"{file}.owl"
    path.write_text(
        ontology_text(f"{_IRI}{file}.owl", entities, imports=[f"{_IRI}{name}.owl" for name in imports]),
        encoding="utf-8",
    )
    return path
