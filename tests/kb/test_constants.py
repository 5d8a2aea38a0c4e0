"""What is always the same: individuals and literals in bindings, literals in fields."""

from __future__ import annotations

from pathlib import Path

import pytest

from grounding.ground import ground
from kb.problems import OntologyRejected
from kb.store import KnowledgeBase
from kb.terms import Action, Argument
from kb.vocabulary import CORE, Kind, Property
from kb.writing import Entity, Literal, Sort, ontology_text

IRI = "http://example.org/concertmaster/constants.owl"


def individual(
    name: str, kind: str, links: dict[str, str] | None = None, values: dict[str, Literal] | None = None
) -> Entity:
    """An individual of the file; kinds and properties are the core's, everything else its own."""
    return Entity(
        iri=f"{IRI}#{name}",
        sort=Sort.INDIVIDUAL,
        types=(kind if ":" in kind else CORE + kind,),
        links=tuple((CORE + p.rstrip("2"), to if ":" in to else f"{IRI}#{to}") for p, to in (links or {}).items()),
        values=tuple((CORE + p, v) for p, v in (values or {}).items()),
    )


def parameter(process: str, name: str, kind: str) -> Entity:
    """An input."""
    values: dict[str, Literal] = {Property.PARAMETER_NAME: name, Property.PARAMETER_NUMBER: 10}
    return individual(f"{process}_{name}", "Input", {Property.PARAMETER_TYPE: kind}, values)


def site(folder: Path, binding: Entity) -> KnowledgeBase:
    """A process that says a text to a guest, and one that does it with one binding."""
    guest = f"{IRI}#Guest"
    parts = [
        Entity(iri=guest, sort=Sort.CLASS),
        individual("ann", guest),
        individual("chair", f"{IRI}#Seat"),
        Entity(iri=f"{IRI}#Seat", sort=Sort.CLASS),
        parameter("Say", "text", CORE + Kind.TEXT),
        parameter("Say", "to", guest),
        individual(
            "Say",
            Kind.ATOMIC_PROCESS,
            {Property.HAS_INPUT: "Say_text", f"{Property.HAS_INPUT}2": "Say_to"},
            {Property.DURATION_S: 1.0},
        ),
        individual(
            "Say_grounding",
            Kind.COMPUTE_GROUNDING,
            {
                Property.GROUNDS: "Say",
                Property.HAS_REQUEST_FIELD: "Say_field",
                f"{Property.HAS_REQUEST_FIELD}2": "Say_volume",
            },
            {Property.SERVICE_NAME: "/voice/say", Property.TIMEOUT_S: 5.0},
        ),
        individual(
            "Say_field",
            Kind.FIELD,
            {Property.MAPS_PARAMETER: "Say_text"},
            {Property.FIELD_NAME: "text", Property.MESSAGE_TYPE: "string"},
        ),
        individual(
            "Say_volume",
            Kind.FIELD,
            {},
            {Property.FIELD_NAME: "volume", Property.MESSAGE_TYPE: "float64", Property.HAS_VALUE: 0.5},
        ),
        parameter("Greet", "to", guest),
        parameter("Greet", "text", CORE + Kind.TEXT),
        individual(
            "Greet",
            Kind.COMPOSITE_PROCESS,
            {
                Property.HAS_INPUT: "Greet_to",
                f"{Property.HAS_INPUT}2": "Greet_text",
                Property.COMPOSED_OF: "Greet_say",
            },
        ),
        individual("Greet_say", Kind.PERFORM, {Property.PERFORMS: "Say", Property.HAS_BINDING: "Greet_binding"}),
        binding,
    ]
    (folder / "sites" / "party").mkdir(parents=True)
    text = ontology_text(IRI, parts, imports=[CORE[:-1]])
    (folder / "sites" / "party" / "party.owl").write_text(text, encoding="utf-8")
    return KnowledgeBase("party", folder)


@pytest.mark.parametrize(
    ("binding", "call"),
    [
        (
            individual("Greet_binding", "Binding", {"toParameter": "Say_text"}, {"hasValue": "it's late"}),
            r"'Say'('it\'s late',To)",
        ),
        (
            individual("Greet_binding", "Binding", {"toParameter": "Say_to", "fromIndividual": "ann"}),
            "'Say'(Text,ann)",
        ),
    ],
)
def test_constants_in_bindings(binding: Entity, call: str, tmp_path: Path) -> None:
    """A binding gives a parameter a literal or an individual, whatever the whole is given."""
    knowledge = site(tmp_path, binding)
    assert f"call(Frame,'Greet_say',{call})" in knowledge.snapshot().program("Greet").text
    knowledge.close()


@pytest.mark.parametrize(
    ("binding", "code", "says"),
    [
        (
            individual("Greet_binding", "Binding", {"toParameter": "Say_to", "fromIndividual": "chair"}),
            "KB112",
            "to of the process that it performs is a Guest, and chair is none",
        ),
        (
            individual("Greet_binding", "Binding", {"toParameter": "Say_to"}, {"hasValue": "ann"}),
            "KB112",
            "has no literal values; name one by fromIndividual",
        ),
        (
            individual(
                "Greet_binding",
                "Binding",
                {"toParameter": "Say_text", "fromParameter": "Greet_text"},
                {"hasValue": "both"},
            ),
            "KB117",
            "needs exactly one fromParameter",
        ),
    ],
)
def test_wrong_constants(binding: Entity, code: str, says: str, tmp_path: Path) -> None:
    """A constant must fit, and be the only thing that a binding gives."""
    with pytest.raises(OntologyRejected) as raised:
        site(tmp_path, binding)
    assert [p.message for p in raised.value.problems if p.code == code and says in p.message]


def test_constants_in_requests(tmp_path: Path) -> None:
    """A text that was asked with is sent as it is; a field with a value of its own carries that."""
    binding = individual("Greet_binding", "Binding", {"toParameter": "Say_to", "fromIndividual": "ann"})
    knowledge = site(tmp_path, binding)
    arguments = (Argument(name="text", role="input", value="ann"), Argument(name="to", role="input", value="ann"))
    action = Action(id="1", process="Say", robots=(), arguments=arguments)
    call = ground(action, knowledge.snapshot(), {}, call_id=1, t_s=0.0)
    assert call.fields == {"text": "ann", "volume": 0.5}
    knowledge.close()
