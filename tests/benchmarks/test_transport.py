"""The benchmarks of transports run; their bars are all on wall time."""

from __future__ import annotations

import pytest

from kb.store import KnowledgeBase
from kb.terms import Var, struct
from tests.benchmarks.harness import main
from tests.benchmarks.kb_bridge import seconds_from_message_to_answer
from tests.benchmarks.transport import run
from tests.kb.conftest import ask


@pytest.mark.slow
def test_the_quick_benchmark_runs() -> None:
    """Every call over every transport is answered as it should be, or it would end with an error."""
    assert main("transport", run, ["--quick", "--check"]) == 0


@pytest.mark.slow
def test_every_message_is_told_and_seen() -> None:
    """One after the other, each by the query right after it."""
    knowledge = KnowledgeBase("tue_lab")
    revision = knowledge.snapshot().revision
    try:

        def places() -> list[str]:
            where = struct("fluent", revision, "locatedAt", "drink_1", Var("Place"))
            answer: list[str] = ask(struct("findall", Var("Place"), struct(":", "kb_facts", where), Var("Answer")))
            return answer

        assert len(seconds_from_message_to_answer(knowledge, places, 20)) == 20
    finally:
        knowledge.close()
