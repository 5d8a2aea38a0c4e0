"""Recipes of a site: listed, imported, retired and restored, in people's files, and never to their harm."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.files import SHIPPED
from kb.problems import OntologyRejected
from kb.recipes import NoSuchRecipe, import_recipe, not_imported, recipes, restore, retire
from kb.store import KnowledgeBase
from kb.terms import Term
from tests.kb.conftest import IRI
from tests.scenarios.see_drink import write_see_drink


@pytest.fixture
def seeing(folder: Path) -> Path:
    """The lab, which imports a task type with one recipe."""
    import_recipe(folder, "tue_lab", write_see_drink(folder))
    return folder


def contents(folder: Path) -> dict[Path, bytes]:
    """All files."""
    return {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def choices(folder: Path) -> str:
    """The program of the task type."""
    knowledge = KnowledgeBase("tue_lab", folder)
    [program] = [p for p in knowledge.snapshot().program("SeeDrink").definitions if _is_of("SeeDrink", p)]
    knowledge.close()
    return str(program)


def _is_of(name: str, definition: Term) -> bool:
    return str(definition).startswith(f"Struct(functor='proc', args=(Struct(functor='{name}'")


def test_an_imported_file_is_one_line_more(folder: Path) -> None:
    """The recipes that come with it are told; a second time is refused."""
    file = write_see_drink(folder)
    before = contents(folder)
    [recipe] = import_recipe(folder, "tue_lab", file)
    assert (recipe.name, recipe.realizes, recipe.file, recipe.retired) == ("LookTwice", ("SeeDrink",), file, False)
    site = folder / "sites" / "tue_lab" / "tue_lab.owl"
    line = f'        <owl:imports rdf:resource="{IRI}see_drink.owl"/>\n'.encode()
    after = contents(folder)
    assert after[site].replace(line, b"") == before[site]
    assert {p for p in after if after[p] != before[p]} == {site}
    with pytest.raises(NoSuchRecipe, match="is imported by tue_lab already"):
        import_recipe(folder, "tue_lab", file)


def test_what_would_be_wrong_is_not_imported(folder: Path) -> None:
    """All files stay as they were: of an import that does not parse, contradicts or is elsewhere."""
    file = write_see_drink(folder)
    text = file.read_text()
    for spoilt, says in ((text[:-9], "KB001"), (text.replace("SearchDrink", "SeekDrink"), "KB011")):
        file.write_text(spoilt)
        before = contents(folder)
        with pytest.raises(OntologyRejected, match=says):
            import_recipe(folder, "tue_lab", file)
        assert contents(folder) == before
    with pytest.raises(NoSuchRecipe, match="imports are looked for there"):
        import_recipe(folder, "tue_lab", SHIPPED / "core" / "core.owl")


def test_the_shipped_site_is_not_changed() -> None:
    """It belongs to the product."""
    file = SHIPPED / "core" / "core.owl"
    with pytest.raises(NoSuchRecipe, match=r"is imported by tue_lab already|not changed"):
        import_recipe(SHIPPED, "tue_lab", file)
    with pytest.raises(NoSuchRecipe, match="is not known; there is FindEachDrink"):
        retire(SHIPPED, "tue_lab", "Navigate")


def test_a_retired_recipe_is_kept_but_not_chosen(seeing: Path) -> None:
    """Restored, the file is what it was, byte by byte."""
    other = write_see_drink(seeing, file="look_thrice", recipe="LookThrice", looks=3)
    import_recipe(seeing, "tue_lab", other)
    assert "LookThrice" in choices(seeing)
    before = contents(seeing)
    retired = retire(
        seeing, "tue_lab", "LookThrice", because='once <is> "too" often — really', superseded_by="LookTwice"
    )
    assert (retired.retired, retired.because, retired.superseded_by) == (
        True,
        'once <is> "too" often — really',
        "LookTwice",
    )
    assert "LookThrice" not in choices(seeing)
    assert {p for p, content in contents(seeing).items() if content != before[p]} == {other}
    with pytest.raises(NoSuchRecipe, match="is retired already: once <is>"):
        retire(seeing, "tue_lab", "LookThrice")
    assert restore(seeing, "tue_lab", "LookThrice").retired is False
    assert contents(seeing) == before
    with pytest.raises(NoSuchRecipe, match="is not retired"):
        restore(seeing, "tue_lab", "LookThrice")


def test_the_last_recipe_of_a_task_stays(seeing: Path) -> None:
    """Or nobody could do it; its file is as it was."""
    before = contents(seeing)
    with pytest.raises(OntologyRejected, match="KB130 error SeeDrink"):
        retire(seeing, "tue_lab", "LookTwice")
    with pytest.raises(NoSuchRecipe, match="cannot be superseded by Nothing"):
        retire(seeing, "tue_lab", "LookTwice", superseded_by="Nothing")
    with pytest.raises(NoSuchRecipe, match="give one line that can be printed"):
        retire(seeing, "tue_lab", "LookTwice", because="old\x01")
    with pytest.raises(NoSuchRecipe, match="is not known; there is FindEachDrink, LookTwice"):
        restore(seeing, "tue_lab", "LookOnce")
    assert contents(seeing) == before


def test_kept_recipes_that_wait_to_be_imported_are_found(seeing: Path) -> None:
    """Files that tell the goal that they were found for."""
    knowledge = KnowledgeBase("tue_lab", seeing)
    ontology = knowledge.snapshot().ontology
    knowledge.close()
    assert [r.name for r in recipes(ontology)] == ["FindEachDrink", "LookTwice"]
    assert not_imported(ontology, seeing) == []
    kept = seeing / "tasks" / "kept.owl"
    kept.write_text("<core:foundForGoal>x</core:foundForGoal>")
    assert not_imported(ontology, seeing) == [kept]
