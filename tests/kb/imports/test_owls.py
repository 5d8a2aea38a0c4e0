"""OWL-S processes become processes of ours; what does not is told of."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.imports.owls import import_owls
from kb.imports.report import Fate, NotImportable
from kb.processes import Role
from tests.kb.imports.owls_files import (
    OWLS,
    atomic,
    bound,
    builtin_atom,
    class_atom,
    composite,
    condition,
    given,
    owls_file,
    parameter,
    perform,
    several,
    value_atom,
)
from tests.kb.imports.worlds import DATA, IRI, definitions, loaded, told

LOOK = atomic("Look", parameter("Input", "Look_Where"), parameter("Output", "Look_Seen"))
TELL = atomic("Tell", parameter("Input", "Tell_What"))


@pytest.mark.parametrize(
    ("kind", "golog"),
    [
        ("Sequence", "[call(Frame,a,'Tell'(What)),call(Frame,b,'Tell'(What))]"),
        ("Split", "conc([call(Frame,a,'Tell'(What)),call(Frame,b,'Tell'(What))])"),
        ("Split-Join", "conc([call(Frame,a,'Tell'(What)),call(Frame,b,'Tell'(What))])"),
        ("Any-Order", "any_order(Frame,'Do_AnyOrder',[call(Frame,a,'Tell'(What)),call(Frame,b,'Tell'(What))])"),
        ("Choice", "choice(Frame,'Do_Choice',[call(Frame,a,'Tell'(What)),call(Frame,b,'Tell'(What))])"),
        ("Iterate", "star(Frame,'Do_Iterate',[call(Frame,a,'Tell'(What)),call(Frame,b,'Tell'(What))])"),
    ],
)
def test_constructs_over_several_steps(kind: str, golog: str, tmp_path: Path) -> None:
    """Each construct of OWL-S over a list of steps is that construct of ours, its steps in order."""
    steps = [perform(name, "Tell", bound("Tell_What", "ThisPerform", "What")) for name in ("a", "b")]
    file = owls_file(tmp_path, TELL + composite("Do", several(kind, *steps), parameter("Input", "What")))
    imported = import_owls(file, IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        assert definitions(snapshot, "Do") == f"proc('Do'(What),{golog})."


@pytest.mark.parametrize("home", [OWLS, "http://localhost:8888/owl_s/1.2", "http://www.daml.org/services/owl-s/1.1"])
def test_the_vocabulary_may_live_anywhere(home: str, tmp_path: Path) -> None:
    """OWL-S is known by the end of its IRIs, 1.1 as well as 1.2."""
    imported = import_owls(owls_file(tmp_path, TELL, home), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        assert [p.name for p in snapshot.processes["Tell"].inputs] == ["what"]


def test_values_go_from_step_to_step(tmp_path: Path) -> None:
    """An output that another step reads goes through a local; one that the whole gives back, straight to it."""
    look = perform("See", "Look", bound("Look_Where", "ThisPerform", "Place"))
    tell = perform("Say", "Tell", bound("Tell_What", "See", "Look_Seen"))
    result = (
        '<p:hasResult><p:Result><p:withOutput><p:OutputBinding><p:toVar rdf:resource="#Found"/><p:valueSource>'
        "<p:ValueOf>"
        '<p:fromProcess rdf:resource="#See"/><p:theVar rdf:resource="#Look_Seen"/></p:ValueOf></p:valueSource>'
        "</p:OutputBinding></p:withOutput></p:Result></p:hasResult>"
    )
    inputs = (parameter("Input", "Place"), parameter("Output", "Found"))
    with_result = LOOK + TELL + composite("Do", several("Sequence", look, tell), *inputs, result)
    imported = import_owls(owls_file(tmp_path, with_result), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        body = "[call(Frame,'See','Look'(Place,Found)),call(Frame,'Say','Tell'(Found))]"
        assert definitions(snapshot, "Do") == f"proc('Do'(Place,Found),{body})."
    without = LOOK + TELL + composite("Do", several("Sequence", look, tell), *inputs)
    imported = import_owls(owls_file(tmp_path, without), IRI)
    assert "Found: no step and no binding of Do gives this output a value" in told(imported, Fate.LEFT_OUT)
    with loaded(imported, tmp_path / "kb2") as snapshot:
        assert "'Look'(Place,loc(Frame,see_seen))" in definitions(snapshot, "Do")
        assert "'Tell'(loc(Frame,see_seen))" in definitions(snapshot, "Do")


def test_values_that_are_given(tmp_path: Path) -> None:
    """A literal stays with its step."""
    file = owls_file(tmp_path, TELL + composite("Do", perform("Say", "Tell", given("Tell_What", "it's me"))))
    with loaded(import_owls(file, IRI), tmp_path / "kb") as snapshot:
        assert definitions(snapshot, "Do") == r"proc('Do',call(Frame,'Say','Tell'('it\'s me')))."


def test_what_is_bound_to_nothing_becomes_an_input(tmp_path: Path) -> None:
    """An input that no binding fills is asked of whoever calls the whole, all the way up; the report says so."""
    inner = composite("Inner", perform("Say", "Tell"))
    outer = composite("Outer", perform("Go", "Inner"))
    imported = import_owls(owls_file(tmp_path, TELL + inner + outer), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        assert definitions(snapshot, "Outer").startswith("proc('Outer'(What),call(Frame,'Go','Inner'(What))).")
    assert "the input what was added to Outer" in told(imported, Fate.ASSUMED)


DOOR = "http://example.net/trial.owl#Door"
OPEN = atomic(
    "Open",
    parameter("Input", "Open_Door", DOOR),
    "<p:hasResult><p:Result><p:hasEffect>"
    + condition(class_atom("Open_", "Open_Door"))
    + "</p:hasEffect></p:Result></p:hasResult>",
)


@pytest.mark.parametrize(
    ("construct", "golog"),
    [
        (
            f"<p:If-Then-Else><p:ifCondition>{condition(class_atom('Open_', 'Door_1'))}</p:ifCondition>"
            f"<p:then>{perform('a', 'Open', bound('Open_Door', 'ThisPerform', 'Door_1'))}</p:then></p:If-Then-Else>",
            "if(holds(isOpen,Door_1,true),call(Frame,a,'Open'(Door_1)),[])",
        ),
        (
            f"<p:Repeat-While><p:whileCondition>{condition(class_atom('Shut', 'Door_1'))}</p:whileCondition>"
            f"<p:whileProcess>{perform('a', 'Open', bound('Open_Door', 'ThisPerform', 'Door_1'))}</p:whileProcess>"
            "</p:Repeat-While>",
            "while(holds(isOpen,Door_1,false),call(Frame,a,'Open'(Door_1)))",
        ),
        (
            "<p:Repeat-Until><p:untilCondition>"
            + condition(class_atom("Open_", "Door_1"), value_atom("isFree", "Door_1", "true", "boolean"))
            + "</p:untilCondition>"
            f"<p:untilProcess>{perform('a', 'Open', bound('Open_Door', 'ThisPerform', 'Door_1'))}</p:untilProcess>"
            "</p:Repeat-Until>",
            "until(call(Frame,a,'Open'(Door_1)),all([holds(isOpen,Door_1,true),holds(isFree,Door_1,true)]))",
        ),
    ],
)
def test_conditions_of_individuals(construct: str, golog: str, tmp_path: Path) -> None:
    """What conditions ask of individuals the planner reckons with; effects change it, complements are its negation."""
    shut = f'<owl:Class rdf:ID="Shut"><owl:complementOf rdf:resource="{DOOR.replace("Door", "Open_")}"/></owl:Class>'
    file = owls_file(tmp_path, shut + OPEN + composite("Do", construct, parameter("Input", "Door_1", DOOR)))
    with loaded(import_owls(file, IRI), tmp_path / "kb") as snapshot:
        assert f"proc('Do'(Door_1),{golog})." in definitions(snapshot, "Do")
        assert snapshot.processes["Do"].inputs[0].kind == "Door"


COUNT = atomic("Count", parameter("Output", "Count_N", "http://www.w3.org/2001/XMLSchema#int"))


def test_conditions_about_data_are_asked_of_a_service(tmp_path: Path) -> None:
    """Before a loop and after each turn of it, a step compares what the planner cannot see."""
    count = perform("First", "Count")
    loop = (
        f"<p:Repeat-While><p:whileCondition>{condition(builtin_atom('lessThan', 'N', '3', 'int'))}</p:whileCondition>"
        f"<p:whileProcess>{perform('Again', 'Count')}</p:whileProcess></p:Repeat-While>"
    )
    body = several("Sequence", count, loop)
    whole = composite("Do", body, parameter("Input", "N", "http://www.w3.org/2001/XMLSchema#int"))
    imported = import_owls(owls_file(tmp_path, COUNT + whole), IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        program = definitions(snapshot, "Do")
        assert program.count("'Do_Test'(N,loc(Frame,test_result))") == 2
        assert "while(is_true(loc(Frame,test_result))" in program
        fields = {f.name: f.constant for f in snapshot.groundings["Do_Test"].request}
        assert fields == {"comparison": "less", "left": None, "left_key": "", "right": "3", "right_key": ""}
        assert snapshot.groundings["Do_Test"].service == "/compute/compare"
    assert "the condition lessThan(N, 3), about data, became a step" in told(imported, Fate.CHANGED)


ATOMS = f"<swrl:AtomList><rdf:first>{class_atom('Open_', 'Door_1')}</rdf:first></swrl:AtomList>".replace("<", "&lt;")


@pytest.mark.parametrize(
    ("body", "golog", "says"),
    [
        (ATOMS, "if(holds(isOpen,Door_1,true)", ""),
        (
            "(open ?Door_1)",
            "if(is_true(loc(Frame,test_result))",
            "the condition (open ?Door_1) became a step that asks the compute service /imported/Do_Test",
        ),
    ],
)
def test_quoted_conditions(body: str, golog: str, says: str, tmp_path: Path) -> None:
    """SWRL in quotes is read as SWRL; what is in another language is asked of a service named for it."""
    construct = (
        f"<p:If-Then-Else><p:ifCondition><e:Expression><e:expressionBody>{body}</e:expressionBody></e:Expression>"
        f"</p:ifCondition><p:then>{perform('a', 'Open', bound('Open_Door', 'ThisPerform', 'Door_1'))}</p:then>"
        "</p:If-Then-Else>"
    )
    file = owls_file(tmp_path, OPEN + composite("Do", construct, parameter("Input", "Door_1", DOOR)))
    imported = import_owls(file, IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        assert golog in definitions(snapshot, "Do")
    assert says in told(imported, Fate.CHANGED)


def test_produce_and_set_copy_values(tmp_path: Path) -> None:
    """Produce gives an output, Set a local, the value of another parameter or a literal, by a step that copies."""
    produce = (
        '<p:Produce rdf:ID="Give"><p:producedBinding><p:OutputBinding><p:toVar rdf:resource="#Out"/>'
        "<p:valueData>done</p:valueData></p:OutputBinding></p:producedBinding></p:Produce>"
    )
    file = owls_file(tmp_path, TELL + composite("Do", several("Sequence", produce), parameter("Output", "Out")))
    with loaded(import_owls(file, IRI), tmp_path / "kb") as snapshot:
        assert definitions(snapshot, "Do") == "proc('Do'(Out),[call(Frame,'Give','CopyText'(done,Out))])."
        assert snapshot.groundings["CopyText"].service == "/compute/copy"


def test_simple_processes_are_task_types(tmp_path: Path) -> None:
    """A SimpleProcess is realized by atomic processes and expands to composite ones: recipes to choose from."""
    simple = (
        f'<p:SimpleProcess rdf:ID="Inform">{parameter("Input", "Inform_What")}<p:realizedBy rdf:resource="#Tell"/>'
        '<p:expandsTo rdf:resource="#Do"/></p:SimpleProcess>'
    )
    do = composite("Do", perform("Say", "Tell", bound("Tell_What", "ThisPerform", "What")), parameter("Input", "What"))
    with loaded(import_owls(owls_file(tmp_path, simple + TELL + do), IRI), tmp_path / "kb") as snapshot:
        body = "choice(Frame,recipe,[call(Frame,'Do','Do'(What)),call(Frame,'Tell','Tell'(What))])"
        assert f"proc('Inform'(What),{body})." in definitions(snapshot, "Inform")


def test_results_with_conditions(tmp_path: Path) -> None:
    """The result whose conditions are about parameters alone is kept: they become preconditions. Others are told of."""
    imported = import_owls(DATA / "owls" / "BravoAirProcess.owl", IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        links = snapshot.ontology
        [precondition] = links.values("hasPrecondition", "LogIn")
        [effect] = links.values("hasEffect", "LogIn")
        assert (links.value("ofProperty", str(precondition)), links.value("ofProperty", str(effect))) == (
            "hasPassword",
            "isLoggedIn",
        )
        assert links.value("hasValue", str(effect)) is True
    assert "its result LogIn_Failed_Result has conditions" in told(imported, Fate.LEFT_OUT)
    assert "TheClient is no parameter of the process" in told(imported, Fate.LEFT_OUT)


def test_groundings(tmp_path: Path) -> None:
    """A WSDL grounding gives the service and its fields their names; transformations are told of, not done."""
    imported = import_owls(DATA / "owls" / "FindCheaperBook.owl", IRI)
    with loaded(imported, tmp_path / "kb") as snapshot:
        found = snapshot.groundings["BookFinderProcess"]
        assert (found.service, found.on_robot) == ("/books/DoKeywordSearch", False)
        assert [(f.name, f.message_type, f.parameter) for f in found.request] == [("keyword", "string", "bookName")]
        assert [f.name for f in found.reply] == ["book_info"]
        parameters = snapshot.processes["FindCheaperBookProcess"].parameters
        assert [(p.name, p.role, p.kind) for p in parameters if p.role is not Role.LOCAL] == [
            ("bookName", Role.INPUT, "Text"),
            ("bookPrice", Role.OUTPUT, "Price"),
            ("bookstore", Role.OUTPUT, "Text"),
        ]
    left_out = told(imported, Fate.LEFT_OUT)
    assert "AmazonBookPrice.owl:69 left out: AmazonPriceProcessGrounding: the transformation (XSLT)" in left_out
    assert (
        "no file beside FindCheaperBook.owl has the ontology http://on.cs.unibas.ch/owl/2003/12/bibtex.owl" in left_out
    )


def test_the_same_file_makes_the_same_text() -> None:
    """Anonymous nodes have other names in each run; the result does not show them."""
    first, second = (import_owls(DATA / "owls" / "FindCheaperBook.owl", IRI) for _ in range(2))
    assert first.text == second.text
    assert first.notes == second.notes
    assert str(DATA) not in first.text
    assert "Imported from the OWL-S file FindCheaperBook.owl" in first.text


def test_nothing_is_lost_silently(tmp_path: Path) -> None:
    """What the importer has never heard of is told of: statements of what it carried over, and whole entities."""
    strange = '<rate xmlns="http://example.net/other#">7</rate>'
    whole = '<shop xmlns="http://example.net/other#" rdf:about="#Corner"><opens>9</opens></shop>'
    file = owls_file(tmp_path, atomic("Tell", strange, parameter("Input", "Tell_What")) + whole)
    left_out = told(import_owls(file, IRI), Fate.LEFT_OUT)
    assert "trial.owl:7 left out: Tell: rate (Tell): there is no place for it" in left_out
    assert "trial.owl:7 left out: Corner: Corner, of the class shop (2 statements): there is no place" in left_out


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ":1 does not parse as XML: no element found"),
        ("<a><b></a>", ":1 does not parse as XML: mismatched tag"),
        ('<!DOCTYPE a [<!ENTITY x "&y;&y;">]><a/>', ":1 the entity x is not a plain IRI"),
        ("<a>&nowhere;</a>", ":1 does not parse as XML: undefined entity"),
        ("@prefix a: <http://a#> .", ":1 does not parse as XML"),
        ('<r:RDF xmlns:r="http://www.w3.org/1999/02/22-rdf-syntax-ns#"/>', "has no OWL-S process"),
    ],
)
def test_what_cannot_be_imported(text: str, says: str, tmp_path: Path) -> None:
    """One message with file and line tells what is wrong with it."""
    file = tmp_path / "wrong.owl"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(NotImportable) as raised:
        import_owls(file, IRI)
    assert says in str(raised.value)
    assert str(raised.value).startswith(str(file))


def test_no_file(tmp_path: Path) -> None:
    """A file that is not there is named."""
    with pytest.raises(NotImportable, match=r"no_such\.owl is no file"):
        import_owls(tmp_path / "no_such.owl", IRI)


def test_other_encodings(tmp_path: Path) -> None:
    """A file says itself how it is encoded; ours is in UTF-8."""
    file = owls_file(tmp_path, atomic("Tell", "<rdfs:comment>f&#252;r</rdfs:comment>", parameter("Input", "What")))
    text = file.read_text(encoding="utf-8").replace('version="1.0"', 'version="1.0" encoding="ISO-8859-1"', 1)
    file.write_bytes(text.replace("&#252;", "\u00fc").encode("latin-1"))
    assert "für" in import_owls(file, IRI).text


@pytest.mark.shared
def test_all_published_examples(shared: Path, tmp_path: Path) -> None:
    """Every example of the OWL-S API passes the check as a file of ours and compiles; one has no processes."""
    folder = shared / "ontologies" / "owls-api" / "examples-1.2"
    files = sorted(f for f in folder.glob("*.owl") if f.name != "MindswapProfileHierarchy.owl")
    assert len(files) == 20
    for file in files:
        with loaded(import_owls(file, IRI), tmp_path / file.stem) as snapshot:
            assert snapshot.processes
    with pytest.raises(NotImportable, match="has no OWL-S process"):
        import_owls(folder / "MindswapProfileHierarchy.owl", IRI)
