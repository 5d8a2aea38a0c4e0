"""`concertmaster kb recipes`: which ways there are to accomplish tasks, and which of them are used."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from executive.exit_codes import OK
from executive.kb_commands.options import add_site
from kb.learned import site_file
from kb.recipes import Recipe, import_recipe, not_imported, recipes, restore, retire
from kb.store import KnowledgeBase


def add_recipes(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    parser = commands.add_parser("recipes", help="review recipes: list, import, retire, restore")
    does = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = does.add_parser("list", help="which recipes there are, and where they come from")
    add_site(listing)
    listing.set_defaults(command=_list)

    importing = does.add_parser("import", help="have a site import the file of a recipe")
    importing.add_argument("file", type=Path, help="an ontology file in the folder, such as my/tasks/find_it.owl")
    add_site(importing)
    importing.set_defaults(command=_import)

    retiring = does.add_parser("retire", help="have a recipe not chosen any more; it is kept")
    retiring.add_argument("recipe", help="its name, such as FindIt")
    retiring.add_argument("--because", default="", metavar="TEXT", help="why, for those who read it later")
    retiring.add_argument("--superseded-by", default="", metavar="RECIPE", help="what is done instead")
    add_site(retiring)
    retiring.set_defaults(command=_retire)

    restoring = does.add_parser("restore", help="have a retired recipe chosen again")
    restoring.add_argument("recipe", help="its name")
    add_site(restoring)
    restoring.set_defaults(command=_restore)


def _list(options: argparse.Namespace) -> int:
    knowledge = KnowledgeBase(options.site, options.knowledge)
    ontology = knowledge.snapshot().ontology
    knowledge.close()
    for recipe in recipes(ontology):
        print("\n".join(_told(recipe)))
    for file in not_imported(ontology, options.knowledge):
        print(f"{file}: not imported by {options.site}")
    return OK


def _import(options: argparse.Namespace) -> int:
    new = import_recipe(options.knowledge, options.site, options.file)
    print(f"{site_file(options.knowledge, options.site)} imports {options.file}")
    for recipe in new:
        print("\n".join(_told(recipe)))
    return OK


def _retire(options: argparse.Namespace) -> int:
    recipe = retire(
        options.knowledge,
        options.site,
        options.recipe,
        because=options.because,
        superseded_by=options.superseded_by,
    )
    print("\n".join(_told(recipe)))
    return OK


def _restore(options: argparse.Namespace) -> int:
    print("\n".join(_told(restore(options.knowledge, options.site, options.recipe))))
    return OK


def _told(recipe: Recipe) -> Iterator[str]:
    use = "retired" if recipe.retired else "in use"
    yield f"{recipe.name}: {use}{' for ' + ', '.join(recipe.realizes) if recipe.realizes else ''}"
    yield f"  {recipe.file}:{recipe.line}"
    if recipe.goal:
        makespan = f", makespan {recipe.makespan_s:.3f} s" if recipe.makespan_s is not None else ""
        kept = f", kept at {recipe.kept_at_s:.2f} s" if recipe.kept_at_s is not None else ""
        knowledge = f", in knowledge {recipe.knowledge[:12]}" if recipe.knowledge else ""
        yield f"  found for {recipe.goal}{makespan}{kept}{knowledge}"
    if recipe.because:
        yield f"  retired because {recipe.because}"
    if recipe.superseded_by:
        yield f"  superseded by {recipe.superseded_by}"
