import json
import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kb.terms import Struct, Term, Var, quote, render, struct
from tests.kb.conftest import ask, probe

# Lone halves of surrogate pairs are no characters of UTF-8.
ATOMS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12) | st.sampled_from(
    [
        "'",
        "''",
        "\\",
        "\\'",
        "\n",
        "\x00",
        "a\x00b",
        "[]",
        "{}",
        "",
        ".",
        "!",
        ",",
        "|",
        "_",
        "A",
        "é",
        "日本",
        "'), halt. %",
    ]
)
LEAVES = (
    ATOMS
    | st.integers(-(2**80), 2**80)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.booleans()
    | st.from_regex(r"[A-Z_][A-Za-z0-9_]{0,6}", fullmatch=True).map(Var)
)
TERMS: st.SearchStrategy[Term] = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.builds(lambda name, args: Struct(name, tuple(args)), ATOMS, st.lists(inner, min_size=1, max_size=4))
    ),
    max_leaves=12,
)


def described(term: Term) -> object:
    """What `describe` of probe.pl must say about a term."""
    match term:
        case bool():
            return described("true" if term else "false")
        case int():
            return {"integer": str(term)}
        case float():
            return {"float": term}
        case str():
            return {"atom": [ord(character) for character in term]}
        case Var():
            return {"variable": True}
        case Struct(functor, args):
            return {"compound": [ord(character) for character in functor], "arguments": [described(a) for a in args]}
        case list():
            return {"list": [described(item) for item in term]}


def numbers(description: dict[str, object]) -> dict[str, object]:
    """Floats come as texts, so that their last digit is Prolog's own."""
    return {"float": float(str(description["float"]))} if "float" in description else description


@settings(max_examples=200, deadline=None)
@given(TERMS)
@example("'), halt. %")
@example(struct("f", "'", "\\", "\n", "\t", "\x00", "日本", "'), halt. %"))
@example(struct("[]", "[]", []))
@example(struct("-", -1, struct("-", 1)))
@example(struct(":-", struct("dynamic", "is"), "mod"))
@example(["a", -0.0, 5e-324, 1e22, 1.7976931348623157e308])
def test_a_term_reaches_prolog_as_it_is(term: Term) -> None:
    """Whatever its atoms hold, a rendered term is read as the same term: nothing lost, nothing run."""
    told = probe(struct("describe", term, Var("Answer")))
    assert json.loads(json.dumps(told), object_hook=numbers) == described(term)


@given(ATOMS)
def test_an_atom_is_one_token_of_one_line(atom: str) -> None:
    """Rendered text has no line end, so that facts stay one a line."""
    assert len(quote(atom).splitlines()) == 1


@settings(max_examples=200, deadline=None)
@given(ATOMS)
def test_an_atom_comes_back_as_it_was(atom: str) -> None:
    """An atom that Prolog answers with is the one that Python sent; three atoms are JSON's constants."""
    constants = {"true": True, "false": False, "null": None}
    assert ask(struct("=", Var("Answer"), atom)) == constants.get(atom, atom)


@pytest.mark.parametrize(
    "term",
    [
        math.inf,
        -math.inf,
        math.nan,
        "\ud800",
        struct("f", "a\udfff"),
        Var("robot"),
        Var(""),
        Var("X, halt"),
        Var("X\n"),
        [struct("f", Var("')"))],
    ],
)
def test_what_prolog_cannot_read_is_refused(term: Term) -> None:
    """Numbers, characters and variable names that Prolog does not have are errors, not other terms."""
    with pytest.raises(ValueError, match="Prolog"):
        render(term)


@pytest.mark.parametrize(
    ("term", "text"),
    [
        ("amigo_1", "amigo_1"),
        ("Laser", "'Laser'"),
        ("it's", r"'it\'s'"),
        (True, "true"),
        (0.35, "0.35"),
        (1e22, "1.0e+22"),
        (Var("Robot"), "Robot"),
        (struct("call", Var("Frame"), [1, "a b"]), "call(Frame,[1,'a b'])"),
    ],
)
def test_terms_read_well(term: Term, text: str) -> None:
    """The text is what a person would write."""
    assert render(term) == text
