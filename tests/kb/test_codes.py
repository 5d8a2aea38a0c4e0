import re
from pathlib import Path

from kb.codes import CODES
from tests.kb.corpus import CORPUS

_CODE = re.compile(r"\bKB\d{3}\b")


def test_every_code_of_the_sources_is_explained_and_none_else_is() -> None:
    """kb/codes.py has what the checks and shapes report, in order."""
    package = Path(__file__).parents[2] / "kb"
    sources = [f for f in (*package.rglob("*.py"), package / "shapes.ttl") if f.name != "codes.py"]
    used = {code for source in sources for code in _CODE.findall(source.read_text(encoding="utf-8"))}
    assert list(CODES) == sorted(used)


def test_every_code_has_a_planted_fault() -> None:
    """No check is without a wrong edit that it finds."""
    assert {case.code for case in CORPUS} == set(CODES)


def test_the_corpus_is_large() -> None:
    """Enough mistakes that a blind spot would show."""
    assert len(CORPUS) >= 90
