"""A ward whose robots, or some of them, have a navigation of their own."""

from __future__ import annotations

from pathlib import Path

_BASE = "http://example.org/concertmaster"
_HAS = f"""
        <rdfs:subClassOf>
            <owl:Restriction>
                <owl:onProperty rdf:resource="{_BASE}/core.owl#hasSoftware"/>
                <owl:someValuesFrom rdf:resource="{_BASE}/own_navigation.owl#OwnNavigation"/>
            </owl:Restriction>
        </rdfs:subClassOf>"""


def give_own_navigation(knowledge: Path, *kinds: str) -> None:
    """Let the robots of some classes of the ward have what the second recipe takes."""
    file = knowledge / "sites" / "ward" / "ward.owl"
    changed = file.read_text(encoding="utf-8")
    for kind in kinds:
        head = f'<owl:Class rdf:about="{_BASE}/ward.owl#{kind}">'
        assert head in changed, kind
        changed = changed.replace(head, head + _HAS)
    file.write_text(changed, encoding="utf-8")
