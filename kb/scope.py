"""The parameters of a process as terms, where a construct or condition speaks of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from kb.ontology import Ontology
from kb.problems import Problem, Severity
from kb.processes import Parameter, Process, Role
from kb.terms import Term, Var, struct
from kb.vocabulary import Property

FRAME = Var("Frame")
"""Stands for the invocation of a process."""


class Reader:
    """Reads an ontology, and gathers what is wrong.

    Attributes:
        problems: Why something has no term, and warnings.
    """

    def __init__(self, ontology: Ontology) -> None:
        self.problems: list[Problem] = []
        self._ontology = ontology

    def problem(self, code: str, entity: str, message: str, severity: Severity = Severity.ERROR) -> None:
        """Remember what is wrong with an entity."""
        found = self._ontology.problem(code, entity, message)
        self.problems.append(replace(found, severity=severity))

    def parts(self, entity: str, prop: Property) -> list[str]:
        """What an entity has for a property, by name."""
        return [str(v) for v in self._ontology.values(prop, entity)]

    def part(self, entity: str, prop: Property) -> str:
        """The one thing that an entity has for a property; shapes have checked that there is one."""
        return str(self._ontology.value(prop, entity))

    def literal(self, entity: str) -> Term | None:
        """The value that a condition or effect states itself."""
        return self._ontology.value(Property.HAS_VALUE, entity)


class Scope:
    """The parameters of a process as terms, within one frame."""

    def __init__(
        self,
        reader: Reader,
        process: Process,
        *,
        frame: Var,
        frames: Mapping[str, Var],
        bound: frozenset[str],
    ) -> None:
        self.process = process
        self.frame = frame
        self._reader = reader
        self._frames = frames
        """Parameters, by entity, that belong to the turn of a for-each."""
        self._bound = bound
        """Parameters, by entity, that a for-each, pick or interrupt around goes over."""

    def binding(self, construct: str) -> Scope:
        """The scope within a for-each, pick or interrupt: what it goes over has a value there."""
        bound = self._bound | {p.entity for p in self.over(construct)}
        return Scope(self._reader, self.process, frame=self.frame, frames=self._frames, bound=bound)

    def inner(self, written: frozenset[str]) -> Scope:
        """The scope of one turn of a for-each: the data written in it belong to that turn."""
        frame = Var("Inner" + self.frame.name)
        frames = {**self._frames, **dict.fromkeys(written, frame)}
        return Scope(self._reader, self.process, frame=frame, frames=frames, bound=self._bound)

    def parameter(self, entity: str) -> Parameter | None:
        """A parameter of the process, by entity."""
        return next((p for p in self.process.parameters if p.entity == entity), None)

    def term(self, entity: str, user: str) -> Term:
        """A parameter, by entity, as the step or condition `user` reads or writes it."""
        parameter = self.parameter(entity)
        if parameter is None:
            self._reader.problem("KB124", entity, f"is used in {self.process.name}, but is no parameter of it")
            return []
        if parameter.is_datum and (parameter.role is Role.LOCAL or entity in self._frames):
            return struct("loc", self._frames.get(entity, FRAME), parameter.name)
        if parameter.role is Role.LOCAL and entity not in self._bound:
            told = f"is used by {user}, but no ForEach or Pick around it goes over it"
            self._reader.problem("KB126", entity, told)
        return variable(parameter)

    def over(self, construct: str) -> list[Parameter]:
        """The parameters that a for-each, pick or interrupt goes over."""
        entities = self._reader.parts(construct, Property.OVER_PARAMETER)
        for entity in entities:
            if self.parameter(entity) is None:
                told = f"goes over {entity}, which is no parameter of {self.process.name}"
                self._reader.problem("KB124", construct, told)
        return [p for p in self.process.parameters if p.entity in entities]

    def subject(self, entity: str) -> Term:
        """Whom a condition or effect speaks of."""
        return self.term(self._reader.part(entity, Property.SUBJECT_PARAMETER), entity)

    def object(self, entity: str) -> Term:
        """The value that a condition or effect speaks of."""
        literal = self._reader.literal(entity)
        if literal is not None:
            return literal
        return self.term(self._reader.part(entity, Property.OBJECT_PARAMETER), entity)


def variable(parameter: Parameter) -> Var:
    """The logical variable of a parameter."""
    return Var(parameter.name[0].upper() + parameter.name[1:])
