"""Recipes that are classes become processes; what they leave open, or say twice and differently, is told of."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.imports.recipes import import_recipes
from kb.imports.report import Fate, NotImportable
from tests.kb.imports.worlds import IRI, definitions, loaded, told

THIS = "http://example.net/tea.owl"
KNOWROB = "http://ias.cs.tum.edu/kb/knowrob.owl"


def recipe_file(folder: Path, body: str) -> Path:
    """A recipe file with these elements."""
    path = folder / "tea.owl"
    path.write_text(
        f'<?xml version="1.0"?>\n<rdf:RDF xml:base="{THIS}" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"\n'
        f'  xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#" xmlns:owl="http://www.w3.org/2002/07/owl#"\n'
        f'  xmlns:k="{KNOWROB}#">\n<owl:Ontology rdf:about=""/>\n{body}\n</rdf:RDF>\n',
        encoding="utf-8",
    )
    return path


def restriction(prop: str, filler: str, sort: str = "someValuesFrom") -> str:
    """`prop some filler`."""
    return (
        f'<rdfs:subClassOf><owl:Restriction><owl:onProperty rdf:resource="{KNOWROB}#{prop}"/>'
        f'<owl:{sort} rdf:resource="#{filler}"/></owl:Restriction></rdfs:subClassOf>'
    )


def action(name: str, *parts: str) -> str:
    """A class of actions."""
    return f'<owl:Class rdf:ID="{name}"><rdfs:subClassOf rdf:resource="{KNOWROB}#Action"/>{"".join(parts)}</owl:Class>'


def order(name: str, first: str, second: str) -> str:
    """An ordering constraint."""
    return (
        f'<k:PartialOrdering-Strict rdf:about="#{name}"><k:occursBeforeInOrdering rdf:resource="#{first}"/>'
        f'<k:occursAfterInOrdering rdf:resource="#{second}"/></k:PartialOrdering-Strict>'
    )


def tea(*constraints: tuple[str, str]) -> str:
    """Three actions and a recipe of them, with these constraints."""
    names = [f"o{n}" for n in range(len(constraints))]
    steps = [restriction("subAction", s) for s in ("Pour", "Boil", "Fetch")]
    whole = action("MakeTea", *steps, *(restriction("orderingConstraints", n, "hasValue") for n in names))
    actions = action("Boil") + action("Fetch", restriction("objectActedOn", "Cup")) + action("Pour")
    cup = '<owl:Class rdf:ID="Cup"/>'
    return cup + actions + whole + "".join(order(n, *c) for n, c in zip(names, constraints, strict=True))


STEP = "call(Frame,'MakeTea_{0}','{0}'(Robot{1}))"
BOIL, FETCH, POUR = STEP.format("Boil", ""), STEP.format("Fetch", ",Cup"), STEP.format("Pour", "")


@pytest.mark.parametrize(
    ("constraints", "body", "fate", "says"),
    [
        ([], f"any_order(Frame,'MakeTea_AnyOrder',[{BOIL},{FETCH},{POUR}])", Fate.ASSUMED, "no order of its 3 steps"),
        ([("Fetch", "Boil"), ("Boil", "Pour")], f"[{FETCH},{BOIL},{POUR}]", None, ""),
        (
            [("Fetch", "Pour"), ("Boil", "Pour")],
            f"[any_order(Frame,'MakeTea_AnyOrder',[{BOIL},{FETCH}]),{POUR}]",
            None,
            "",
        ),
        (
            [("Fetch", "Pour")],
            f"[any_order(Frame,'MakeTea_AnyOrder',[{BOIL},{FETCH}]),{POUR}]",
            Fate.CHANGED,
            "its order is partial; also MakeTea_Boil before MakeTea_Pour",
        ),
        (
            [("Fetch", "Boil"), ("Heat", "Pour"), ("Boil", "Heat")],
            "",
            Fate.LEFT_OUT,
            "speak of Heat, which is no step of it",
        ),
        (
            [("Fetch", "Boil"), ("Boil", "Fetch")],
            f"any_order(Frame,'MakeTea_AnyOrder',[{BOIL},{FETCH},{POUR}])",
            Fate.LEFT_OUT,
            "go round in a circle",
        ),
    ],
)
def test_order(constraints: list[tuple[str, str]], body: str, fate: Fate | None, says: str, tmp_path: Path) -> None:
    """Ordering constraints become sequences of steps in any order; what they cannot say, or contradict, is told of."""
    imported = import_recipes(recipe_file(tmp_path, tea(*constraints)), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        program = definitions(snapshot, "MakeTea")
        if body:
            assert program == f"proc('MakeTea'(Robot,Cup),{body})."
        assert program.count("call(") == 3
    if fate is not None:
        assert says in told(imported, fate)
    else:
        assert "order" not in told(imported, Fate.CHANGED)


def test_fillers(tmp_path: Path) -> None:
    """A class becomes an input, an individual a constant; `some` of an individual is read as it was meant."""
    body = (
        '<k:Cup rdf:about="#cup1"/>'
        + action("Fetch", restriction("objectActedOn", "cup1"), restriction("bodyPartsUsed", "hand"))
        + action("MakeTea", restriction("subAction", "Fetch"))
    )
    imported = import_recipes(recipe_file(tmp_path, body), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        assert definitions(snapshot, "MakeTea") == (
            "proc('MakeTea'(Robot),call(Frame,'MakeTea_Fetch','Fetch'(Robot,cup1)))."
        )
        assert snapshot.groundings["Fetch"].service == "/{robot}/fetch"
        assert snapshot.ontology.is_a("cup1", "PhysicalObject")
    assert "objectActedOn some cup1, which is an individual, was read as objectActedOn value that" in told(
        imported, Fate.CHANGED
    )
    assert "bodyPartsUsed hand: what an action needs of a robot" in told(imported, Fate.LEFT_OUT)


def test_one_action_in_several_ways(tmp_path: Path) -> None:
    """Two steps of one class that differ in where to are two processes, in any recipe; what is said twice is one."""

    def go(place: str) -> str:
        return (
            f'<rdfs:subClassOf><owl:Restriction><owl:onProperty rdf:resource="{KNOWROB}#subAction"/>'
            '<owl:someValuesFrom><owl:Class><owl:intersectionOf rdf:parseType="Collection">'
            '<rdf:Description rdf:about="#Go"/>'
            f'<owl:Restriction><owl:onProperty rdf:resource="{KNOWROB}#toLocation"/>'
            f'<owl:hasValue rdf:resource="#{place}"/></owl:Restriction>'
            "</owl:intersectionOf></owl:Class></owl:someValuesFrom></owl:Restriction></rdfs:subClassOf>"
        )

    places = "".join(f'<k:Spot rdf:about="#{place}"/>' for place in ("hall", "kitchen"))
    ways = action("There", go("hall"), go("kitchen"), go("hall")) + action("Back", go("hall"))
    imported = import_recipes(recipe_file(tmp_path, places + action("Go") + ways), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        there, back = definitions(snapshot, "There"), definitions(snapshot, "Back")
    [hall] = [name for name in ("Go", "Go_2") if f"'{name}'(Robot,hall)" in there]
    [kitchen] = {"Go", "Go_2"} - {hall}
    assert there.count("call(") == 2
    assert f"'{kitchen}'(Robot,kitchen)" in there
    assert f"'{hall}'(Robot,hall)" in back


def test_things_of_one_class_are_taken_to_be_one(tmp_path: Path) -> None:
    """From a room to a room: the report says that it became the same."""
    carry = action("Carry", restriction("fromLocation", "Spot"), restriction("toLocation", "Spot"))
    body = '<owl:Class rdf:ID="Spot"/>' + carry + action("Tidy", restriction("subAction", "Carry"))
    imported = import_recipes(recipe_file(tmp_path, body), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        assert "'Carry'(Robot,Spot,Spot)" in definitions(snapshot, "Tidy")
    assert "Tidy: its steps' inputs of the class Spot are taken to be the same one" in told(imported, Fate.ASSUMED)


def test_no_recipe(tmp_path: Path) -> None:
    """A file of other classes is refused."""
    with pytest.raises(NotImportable, match="has no recipe in it"):
        import_recipes(recipe_file(tmp_path, action("Boil")), IRI)


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "process", "begins", "fate", "says"),
    [
        (
            "serve_drink",
            "ServeADrink",
            "[call(Frame,'ServeADrink_MoveBaseToGraspPose',",
            Fate.GUESSED,
            "serve_drink.owl:109 guessed: ServeADrink: its ordering constraints speak of GraspBottle, which is no step "
            "of it; it was taken for GraspObjectWithRightGripper",
        ),
        (
            "serve_drink_new",
            "ServeADrink",
            "any_order(",
            Fate.CHANGED,
            "Patient: owl:subClassOf is no term of OWL; it was read as rdfs:subClassOf",
        ),
        ("set_a_table", "SetATable", "any_order(", Fate.ASSUMED, "SetATable: gives no order of its 7 steps"),
    ],
)
def test_published_recipes(
    name: str, process: str, begins: str, fate: Fate, says: str, shared: Path, tmp_path: Path
) -> None:
    """The recipes of RoboEarth pass the check and compile; their faults are named."""
    imported = import_recipes(shared / "ontologies" / "roboearth" / f"{name}.owl", IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        _, _, body = definitions(snapshot, process).partition("),")
        assert body.startswith(begins)
    assert says in told(imported, fate)
