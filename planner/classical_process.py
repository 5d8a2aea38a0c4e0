"""A plan for a goal as a process of its own, which a session performs like any other."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import MappingProxyType

from kb.compiler import Compiler, Program
from kb.processes import Process
from kb.prolog import Entry
from kb.store import Snapshot
from kb.terms import Struct, Term, Var, struct
from planner.classical_goal import GoalPlan
from planner.classical_recipe import calls

PROCESS = "reach goal"
"""The process that a goal becomes; with a blank, which no name of an ontology has."""

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_revisions = itertools.count(-1, -1)
"""Those of knowledge bases are above 0."""


class GoalProcess:
    """The knowledge of a snapshot and one more process, PROCESS, in a revision of its own.

    So the plan disturbs nobody and goes away whole; a site is a few hundred facts. Close it after the sessions
    that it was made for.

    Attributes:
        snapshot: For those sessions.
    """

    def __init__(self, plan: GoalPlan, snapshot: Snapshot) -> None:
        """Load the facts.

        Args:
            plan: One with a program.
        """
        assert plan.program is not None, "a process for a goal that is out of reach"
        revision = next(_revisions)
        compiler = _Compiler(snapshot, plan.program)
        facts = compiler.facts(revision)
        stated = [fact for fact in facts if not (isinstance(fact, Struct) and fact.functor == "fluent")]
        told = [struct("fluent", revision, *subject, value) for subject, value in sorted(snapshot.fluents.items())]
        _load_facts([*stated, *told, struct("definition", revision, PROCESS, Var("Frame"), plan.program)])
        process = Process(name=PROCESS, is_atomic=False, parameters=())
        self.snapshot = replace(
            snapshot,
            revision=revision,
            processes=MappingProxyType({**snapshot.processes, PROCESS: process}),
            compiler=compiler,
        )

    def close(self) -> None:
        """Forget the facts."""
        _drop_facts(self.snapshot.revision)


class _Compiler(Compiler):
    """Knows the program of the goal, too."""

    def __init__(self, snapshot: Snapshot, body: Term) -> None:
        super().__init__(snapshot.ontology, snapshot.processes)
        self._body = body

    def program(self, name: str) -> Program:
        if name != PROCESS:
            return super().program(name)
        definitions: list[Term] = [struct("proc", PROCESS, self._body)]
        for _, callee, _ in calls(self._body):
            definitions += (d for d in super().program(callee).definitions if d not in definitions)
        return Program(name=PROCESS, definitions=tuple(definitions))
