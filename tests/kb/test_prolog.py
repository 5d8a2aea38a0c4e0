import os
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from kb.errors import InternalError
from kb.prolog import Entry, PrologError
from kb.terms import Term, Var, struct
from tests.kb.conftest import ask, probe

FINE = struct("=", Var("Answer"), "fine")


def thrown(goal: Term) -> PrologError:
    """The error that a goal must end in."""
    with pytest.raises(PrologError) as caught:
        ask(goal)
    return caught.value


def test_an_error_term_becomes_an_exception() -> None:
    """Functor and arguments of the error term are told apart, and the message is Prolog's own."""
    error = thrown(struct("atom_length", Var("Unbound"), Var("Answer")))
    assert error.formal == ("instantiation_error",)
    assert "not sufficiently instantiated" in str(error)
    error = thrown(struct("atom_length", "abc", "d"))
    assert error.formal == ("type_error", "integer", "d")
    assert isinstance(error, InternalError)


def test_any_thrown_term_becomes_an_exception() -> None:
    """Also one that is no `error(_, _)`, with quotes where Prolog needs them."""
    assert thrown(struct("throw", struct("Oh no", "it's"))).formal == ("'Oh no'", r"'it\'s'")
    assert thrown(struct("throw", 42)).formal == ("42",)


def test_a_failed_entry_is_an_error() -> None:
    """An entry is det: no answer is a mistake of ours."""
    assert thrown("fail").formal[0] == "entry_failed"


def test_an_unknown_entry_is_an_error() -> None:
    """A misspelt name does not pass for a failure."""
    missing = Entry(search_path="kb_rules", file="facts", name="load_fatcs")
    with pytest.raises(PrologError) as caught:
        missing([])
    assert caught.value.formal[0] == "existence_error"


def test_an_answer_that_is_no_json_is_an_error() -> None:
    """A compound answer is refused, and the next call works."""
    with pytest.raises(InternalError):
        ask(struct("=", Var("Answer"), struct("f", 1)))
    assert ask(FINE) == "fine"


def test_a_runaway_recursion_ends_in_an_error() -> None:
    """The stack limit stops it; the next call works."""
    with pytest.raises(PrologError) as caught:
        probe(struct("runaway", Var("Answer")))
    assert caught.value.formal[0] == "resource_error"
    assert ask(FINE) == "fine"


def test_the_stack_limit_holds_in_every_thread() -> None:
    """A thread that Prolog did not start has the same limit as the one that loaded it."""
    limit = struct("current_prolog_flag", "stack_limit", Var("Answer"))
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(ask, limit).result() == ask(limit) == 512 * 1024 * 1024


def test_threads_take_turns() -> None:
    """Calls from several threads at once give each its own answer."""
    start = threading.Barrier(6)

    def work(worker: int) -> list[str]:
        start.wait()
        return [ask(struct("atom_concat", f"w{worker}_", n, Var("Answer"))) for n in range(50)]

    with ThreadPoolExecutor(6) as pool:
        for worker, answers in enumerate(pool.map(work, range(6))):
            assert answers == [f"w{worker}_{n}" for n in range(50)]


def test_a_thread_leaves_no_engine_behind() -> None:
    """Threads that come and go do not add up in Prolog."""
    engines = struct("statistics", "threads", Var("Answer"))
    before = ask(engines)
    for _ in range(20):
        with ThreadPoolExecutor(1) as pool:
            assert pool.submit(ask, FINE).result() == "fine"
    assert ask(engines) == before


def test_atoms_are_released() -> None:
    """20,000 calls with an atom each that was never seen leave the atom table as it was."""
    ask(FINE)  # the engine is there
    atoms = struct(",", "garbage_collect_atoms", struct("statistics", "atoms", Var("Answer")))
    echo = Entry(search_path="kb_rules", file="facts", name="=")
    before = ask(atoms)
    for n in range(20_000):
        assert echo(f"atom never seen before {n}").endswith(str(n))
    assert ask(atoms) - before < 1000


def test_large_answers_come_whole() -> None:
    """An answer of a megabyte, with characters of several bytes, is not cut."""
    text = "é日" * 200_000
    assert ask(struct("=", Var("Answer"), text)) == text


def test_the_packages_may_lie_in_a_folder_of_any_name(tmp_path: Path) -> None:
    """With a blank, a quote, and letters that Latin-1 has or has not."""
    folder = tmp_path / "it's für Łódź"
    package = Path(__file__).parents[2] / "kb"
    shutil.copytree(package, folder / "kb", ignore=shutil.ignore_patterns("ontologies", "__pycache__"))
    call = "from kb.prolog import Entry; print(Entry(search_path='kb_rules', file='facts', name='load_facts')([]))"
    environment = {**os.environ, "PYTHONPATH": str(folder), "LC_ALL": "C.UTF-8"}
    ran = subprocess.run(
        [sys.executable, "-c", call], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert (ran.stdout, ran.stderr) == ("{'count': 0}\n", "")
