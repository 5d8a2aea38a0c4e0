import re
from pathlib import Path

import pytest

from kb.compiler import Compiler
from kb.files import OntologyFiles
from kb.ontology import close
from kb.processes import read_processes
from kb.reasoner import classify
from kb.store import KnowledgeBase, load
from kb.terms import Struct, Term, render
from tests.conftest import Golden
from tests.kb.conftest import AMIGO, NAVIGATION, SITE

OWL = Path(__file__).parents[1] / "data" / "owl"


@pytest.fixture(scope="module")
def constructs() -> Compiler:
    """The compiled made-up ontology of control constructs."""
    ontology = load(OWL / "constructs.owl", OWL)
    compiler = Compiler(ontology, read_processes(ontology))
    compiler.facts(1)
    return compiler


@pytest.fixture(scope="module")
def language() -> Compiler:
    """The compiled made-up ontology of what else can be said: order, priority, resources, teams, task types."""
    ontology = load(OWL / "language.owl", OWL)
    compiler = Compiler(ontology, read_processes(ontology))
    compiler.facts(1)
    return compiler


def facts_named(compiler: Compiler, *names: str) -> list[str]:
    """The facts of some predicates, as text, in the order in which they are loaded."""
    return [render(f) for f in compiler.facts(1) if isinstance(f, Struct) and f.functor in names]


def body(compiler: Compiler, process: str) -> str:
    """The body of a procedure as text."""
    definition = compiler.program(process).definitions[0]
    assert isinstance(definition, Struct)
    return render(definition.args[1])


def shipped_facts(shipped: KnowledgeBase) -> str:
    """All facts of the shipped site, as text."""
    return "\n".join(map(render, shipped.snapshot().compiler.facts(1)))


def facts_of(folder: Path) -> str:
    """All facts of the site of a folder, as text."""
    ontology = load(folder / SITE, folder)
    return "\n".join(map(render, Compiler(ontology, read_processes(ontology)).facts(1)))


def test_find_empty_drink_compiles_to_its_program(shipped: KnowledgeBase, golden: Golden) -> None:
    """The program of the task, callers first, as the planner gets it."""
    golden(
        Path(__file__).parent / "golden" / "find_empty_drink.pl",
        shipped.snapshot().program("FindEmptyDrink").text + "\n",
    )


def test_a_program_has_each_procedure_once_callers_first(shipped: KnowledgeBase) -> None:
    """Every composite process that the task needs, and no other."""
    heads: list[Term] = [
        d.args[0] for d in shipped.snapshot().program("FindEmptyDrink").definitions if isinstance(d, Struct)
    ]
    assert [h.functor for h in heads if isinstance(h, Struct)] == [
        "FindEmptyDrink",
        "FindEachDrink",
        "SearchDrink",
        "Navigate",
        "Localize",
    ]


def test_choice_and_split_join(constructs: Compiler) -> None:
    """Alternatives carry the step that chooses; parallel branches are a list."""
    assert body(constructs, "Either") == (
        "choice(Frame,'Either_body',[call(Frame,'Either_Beep','Beep'(Robot)),"
        "conc([call(Frame,'Either_both_Beep','Beep'(Robot)),"
        "call(Frame,'Either_both_Look','Look'(Robot,loc(Frame,'Either_both_Look_seen')))])])"
    )


def test_if_while_and_negation(constructs: Compiler) -> None:
    """Steps are in the order of their numbers (100 after 20); what a step outputs, the next condition reads."""
    look = "call(Frame,'{}','Look'(Robot,loc(Frame,seen)))"
    assert body(constructs, "Watch") == (
        f"[{look.format('Watch_10_Look')},"
        f"if(is_true(loc(Frame,seen)),call(Frame,'Watch_20_Beep','Beep'(Robot)),{look.format('Watch_20_Look')}),"
        f"while(not(is_true(loc(Frame,seen))),{look.format('Watch_100_Look')})]"
    )


def test_data_made_in_a_for_each_belongs_to_the_turn(constructs: Compiler) -> None:
    """Turns do not share places: theirs are in the inner frame; the condition is asked in the outer one."""
    assert body(constructs, "Patrol") == (
        "foreach(Frame,'Patrol_body',['-'(Location,'Location')],"
        "any([holds(inArea,Location,Area),holds(locatedAt,Robot,Location)]),InnerFrame,"
        "[call(InnerFrame,'Patrol_10_Go','Go'(Robot,Location)),"
        "call(InnerFrame,'Patrol_20_Look','Look'(Robot,loc(InnerFrame,seen))),"
        "if(is_true(loc(InnerFrame,seen)),call(InnerFrame,'Patrol_30_Either','Either'(Robot)),[])])"
    )


@pytest.mark.parametrize(
    ("process", "text"),
    [
        # In the order of their names, which a choice counts: not of what they perform.
        ("Shuffle", "any_order(Frame,'Shuffle_body',[{Shuffle_a},{Shuffle_b}])"),
        # What follows a split goes on beside it.
        ("Begin", "[{Begin_10},conc([{Begin_20_a},{Begin_20_b},[{Begin_30}]])]"),
        ("Leave", "[{Leave_10},conc([{Leave_20_a}])]"),
        ("Again", "star(Frame,'Again_body',{Again_Beep})"),
        ("Hold", "[test(compare(at_least,value(batteryLevel,Robot),0.9)),{Hold_20}]"),
        # By stepNumber; 100 is after 20.
        (
            "Guard",
            "pconc([interrupt(Frame,'Guard_10',[],"
            "compare(less,value(batteryLevel,Robot),value(chargeAt,Robot)),{Guard_10_Beep}),"
            "interrupt(Frame,'Guard_20',['-'(Door,'Door')],holds(isOpen,Door,true),"
            "call(Frame,'Guard_20_Pass','Pass'(Robot,Door))),{Guard_100}])",
        ),
        ("Think", "search(deadline(12500,{Think_Beep}))"),
    ],
)
def test_constructs_beyond_the_plain_ones(language: Compiler, process: str, text: str) -> None:
    """Each has its term; steps that beep are written {Step}."""
    found = re.sub(r"call\(Frame,'(\w+)','Beep'\(Robot\)\)", r"{\1}", body(language, process))
    assert found == text


def test_what_only_looks_wrong_is_accepted(language: Compiler) -> None:
    """A loop may ask for what a step beside it finds out; a part not done every turn may use what the last made."""
    asked = "is_true(loc(Frame,seen))"
    assert f"until(call(Frame,'Wait_a_Beep','Beep'(Robot)),{asked})" in body(language, "Wait")
    assert f"if({asked},call(Frame,'Turn_20_Beep','Beep'(Robot)),[])" in body(language, "Turn")


def test_a_task_type_is_a_choice_between_its_recipes(language: Compiler) -> None:
    """In the order of their names; its program holds theirs."""
    report = language.program("Report").text
    assert "proc('Report'(Robot),[call(Frame,'Report_10','Signal'(Robot))])" in report
    choice = "choice(Frame,recipe,[call(Frame,'Again','Again'(Robot)),call(Frame,'Beep','Beep'(Robot))])"
    assert body(language, "Signal") == choice
    assert f"proc('Signal'(Robot),{choice})." in report
    assert "proc('Again'(Robot)," in report


def test_robots_of_a_process_are_in_the_order_of_their_numbers(language: Compiler) -> None:
    """The first is the one that travels; neither names nor the sorting of facts change that."""
    assert [f for f in facts_named(language, "agent") if "Lift" in f] == [
        "agent(1,'Lift'(Zero,Second,First),Zero)",
        "agent(1,'Lift'(Zero,Second,First),Second)",
        "agent(1,'Lift'(Zero,Second,First),First)",
    ]


def test_of_a_team_is_asked_what_each_of_it_needs(language: Compiler) -> None:
    """All lift, but only the second beeps; nothing is asked for the sake of what may be done no time."""
    asked = facts_named(language, "requires")
    assert [f for f in asked if "Carry" in f] == ["requires(1,'Carry','RobotWithBase')"]
    assert "requires(1,'Shuffle','RobotWithKinect')" in asked
    assert not [f for f in asked if "Again" in f or "Signal" in f or "Report" in f]


def test_resources_odds_and_what_is_known_of_things(language: Compiler) -> None:
    """What a process uses, how likely it succeeds; values of all individuals that a parameter may name."""
    assert facts_named(language, "claims", "odds", "keeps_robot") == [
        "claims(1,'Pass'(Robot,Door),Door)",
        "keeps_robot(1,'Carry')",
        "odds(1,'Pass',0.8)",
    ]
    assert {
        "kind(1,door_1,'Door')",
        "value(1,capacity,door_1,2)",
        "value(1,width_m,door_1,0.9)",
        "fluent(1,isOpen,door_1,true)",
        "value(1,energy_J,mule_1,3600.0)",
        "value(1,power_W,mule_1,2.0)",
        "value(1,chargeAt,mule_1,0.2)",
    } <= set(facts_named(language, "kind", "value", "fluent"))


def test_what_a_process_requires_follows_from_what_it_performs(constructs: Compiler) -> None:
    """Of a choice, only what every branch asks; of all else, everything."""
    requires: dict[str, set[Term]] = {}
    for fact in constructs.facts(1):
        if isinstance(fact, Struct) and fact.functor == "requires":
            requires.setdefault(str(fact.args[1]), set()).add(fact.args[2])
    assert requires == {
        "Beep": {"RobotWithKinect"},
        "Go": {"RobotWithBase"},
        "Look": {"RobotWithLaser"},
        "Either": {"RobotWithKinect"},
        "Watch": {"RobotWithKinect", "RobotWithLaser"},
        "Patrol": {"RobotWithBase", "RobotWithLaser", "RobotWithKinect"},
    }


def test_facts_are_sorted_and_whole(shipped: KnowledgeBase) -> None:
    """Facts are in order, none twice."""
    snapshot = shipped.snapshot()
    texts = [render(fact) for fact in snapshot.compiler.facts(7)]
    assert texts == sorted(set(texts))
    assert "kind(7,amigo_1,'RobotWithKinect')" in texts
    assert "fluent(7,locatedAt,amigo_1,start_west)" in texts
    assert "value(7,inArea,at_bar,tue_lab)" in texts  # in the kitchen, which is in the lab
    assert "value(7,radius_m,amigo_1,0.35)" in texts  # of its class
    assert "requires(7,'SearchDrink','RobotWithKinect')" in texts  # as it takes a picture
    assert "duration(7,'Navigate'(Robot,Area,Location),travel(Robot,Location,1500))" in texts


def test_facts_do_not_depend_on_the_order_of_files(shipped: KnowledgeBase) -> None:
    """The same files listed in another order give the same bytes."""
    files = shipped.snapshot().ontology.files
    turned = OntologyFiles(files=files.files[::-1])
    texts = []
    for each in (files, turned):
        ontology = close(each, classify(each))
        compiler = Compiler(ontology, read_processes(ontology))
        texts.append([render(fact) for fact in compiler.facts(1)] + [compiler.program("FindEmptyDrink").text])
    assert texts[0] == texts[1]


def test_facts_do_not_depend_on_where_files_stand(folder: Path, shipped: KnowledgeBase) -> None:
    """Moved and renamed files, found by their IRI, give the same bytes."""
    before = shipped_facts(shipped)
    (folder / AMIGO).rename(folder / "zz_amigo.owl")
    (folder / NAVIGATION).rename(folder / "sites" / "a.owl")
    assert facts_of(folder) == before


def test_renaming_changes_nothing_but_the_name(folder: Path, shipped: KnowledgeBase) -> None:
    """A robot of another name has the same facts under its new name."""
    before = shipped_facts(shipped)
    text = (folder / SITE).read_text(encoding="utf-8")
    (folder / SITE).write_text(text.replace("#amigo_1", "#zorro"), encoding="utf-8")
    assert facts_of(folder).splitlines() == sorted(before.replace("amigo_1", "zorro").splitlines())


def test_a_robot_without_a_kinect_is_not_capable(folder: Path, shipped: KnowledgeBase) -> None:
    """Taking the Kinect from the class Amigo changes what amigo_1 is, and nothing that is asked of it."""
    before = set(shipped_facts(shipped).splitlines())
    text = (folder / AMIGO).read_text(encoding="utf-8")
    start = text.index("        <rdfs:subClassOf>", text.index("core.owl#LaserScanner"))
    end = text.index("</rdfs:subClassOf>\n", start) + len("</rdfs:subClassOf>\n")
    assert "core.owl#Kinect" in text[start:end]
    (folder / AMIGO).write_text(text[:start] + text[end:], encoding="utf-8")
    after = set(facts_of(folder).splitlines())
    assert before - after == {"kind(1,amigo_1,'RobotWithKinect')"}
    assert after - before == set()
