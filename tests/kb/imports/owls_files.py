"""OWL-S files for tests, put together of parts."""

from __future__ import annotations

from pathlib import Path

OWLS = "http://www.daml.org/services/owl-s/1.2"
THIS = "http://example.net/trial.owl"
XSD = "http://www.w3.org/2001/XMLSchema#"


def owls_file(folder: Path, body: str, home: str = OWLS) -> Path:
    """A file with these elements; `p:` is the process vocabulary."""
    path = folder / "trial.owl"
    path.write_text(
        f'<?xml version="1.0"?>\n<rdf:RDF xml:base="{THIS}" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"\n'
        f'  xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#" xmlns:owl="http://www.w3.org/2002/07/owl#"\n'
        f'  xmlns:p="{home}/Process.owl#" xmlns:g="{home}/Grounding.owl#" xmlns:l="{home}/generic/ObjectList.owl#"\n'
        f'  xmlns:e="{home}/generic/Expression.owl#" xmlns:swrl="http://www.w3.org/2003/11/swrl#" xmlns="{THIS}#">\n'
        f'<owl:Ontology rdf:about=""/>\n{body}\n</rdf:RDF>\n',
        encoding="utf-8",
    )
    return path


def parameter(role: str, name: str, kind: str = f"{XSD}string") -> str:
    """An input, output or local within a process."""
    return (
        f'<p:has{role}><p:{role} rdf:ID="{name}"><p:parameterType rdf:datatype="{XSD}anyURI">{kind}'
        f"</p:parameterType></p:{role}></p:has{role}>"
    )


def atomic(name: str, *parts: str) -> str:
    """An atomic process."""
    return f'<p:AtomicProcess rdf:ID="{name}">{"".join(parts)}</p:AtomicProcess>'


def composite(name: str, construct: str, *parts: str) -> str:
    """A composite process."""
    body = f"<p:composedOf>{construct}</p:composedOf>"
    return f'<p:CompositeProcess rdf:ID="{name}">{"".join(parts)}{body}</p:CompositeProcess>'


def perform(step: str, process: str, *bindings: str) -> str:
    """A step."""
    return f'<p:Perform rdf:ID="{step}"><p:process rdf:resource="#{process}"/>{"".join(bindings)}</p:Perform>'


def bound(to: str, step: str, variable: str) -> str:
    """An input binding to an output of a step, or of `ThisPerform`."""
    source = f"{OWLS}/Process.owl#ThisPerform" if step == "ThisPerform" else f"#{step}"
    return (
        f'<p:hasDataFrom><p:InputBinding><p:toVar rdf:resource="#{to}"/><p:valueSource><p:ValueOf>'
        f'<p:fromProcess rdf:resource="{source}"/><p:theVar rdf:resource="#{variable}"/></p:ValueOf></p:valueSource>'
        "</p:InputBinding></p:hasDataFrom>"
    )


def given(to: str, value: str, datatype: str = "string") -> str:
    """An input binding to a value."""
    return (
        f'<p:hasDataFrom><p:InputBinding><p:toVar rdf:resource="#{to}"/>'
        f'<p:valueData rdf:datatype="{XSD}{datatype}">{value}</p:valueData></p:InputBinding></p:hasDataFrom>'
    )


def several(kind: str, *steps: str) -> str:
    """A construct over a list of steps, nested as OWL-S nests it."""
    nested = f'<p:ControlConstructList rdf:about="{OWLS}/generic/ObjectList.owl#nil"/>'
    for step in reversed(steps):
        nested = f"<p:ControlConstructList><l:first>{step}</l:first><l:rest>{nested}</l:rest></p:ControlConstructList>"
    return f"<p:{kind}><p:components>{nested}</p:components></p:{kind}>"


def condition(*atoms: str) -> str:
    """A condition in SWRL."""
    nested = '<swrl:AtomList rdf:about="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/>'
    for atom in reversed(atoms):
        nested = f"<swrl:AtomList><rdf:first>{atom}</rdf:first><rdf:rest>{nested}</rdf:rest></swrl:AtomList>"
    return f"<e:SWRL-Condition><e:expressionObject>{nested}</e:expressionObject></e:SWRL-Condition>"


def class_atom(kind: str, argument: str) -> str:
    """`kind(argument)`."""
    return (
        f'<swrl:ClassAtom><swrl:classPredicate rdf:resource="#{kind}"/><swrl:argument1 rdf:resource="#{argument}"/>'
        "</swrl:ClassAtom>"
    )


def value_atom(prop: str, argument: str, value: str, datatype: str = "") -> str:
    """`prop(argument, value)`; a variable without a datatype."""
    second = (
        f'<swrl:argument2 rdf:datatype="{XSD}{datatype}">{value}</swrl:argument2>'
        if datatype
        else f'<swrl:argument2 rdf:resource="#{value}"/>'
    )
    return (
        f'<swrl:DatavaluedPropertyAtom><swrl:propertyPredicate rdf:resource="#{prop}"/>'
        f'<swrl:argument1 rdf:resource="#{argument}"/>{second}</swrl:DatavaluedPropertyAtom>'
    )


def builtin_atom(name: str, left: str, right: str, datatype: str = "") -> str:
    """A comparison of a variable with another, or with a literal."""
    second = (
        f'<rdf:first rdf:datatype="{XSD}{datatype}">{right}</rdf:first>'
        if datatype
        else f'<rdf:first rdf:resource="#{right}"/>'
    )
    nil = "http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"
    return (
        f'<swrl:BuiltinAtom><swrl:builtin rdf:resource="http://www.w3.org/2003/11/swrlb#{name}"/><swrl:arguments>'
        f'<rdf:List><rdf:first rdf:resource="#{left}"/><rdf:rest><rdf:List>{second}<rdf:rest rdf:resource="{nil}"/>'
        "</rdf:List></rdf:rest></rdf:List></swrl:arguments></swrl:BuiltinAtom>"
    )
