"""What tests of the executive share: one recorded run, and the knowledge of the shipped site."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from executive.cli import main
from kb.files import SHIPPED
from kb.store import KnowledgeBase, Snapshot


@pytest.fixture(scope="session")
def snapshot() -> Iterator[Snapshot]:
    """What is known of the shipped site."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge.snapshot()
    knowledge.close()


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short run of the command line: trace and pictures."""
    out = tmp_path_factory.mktemp("run")
    assert main(["run", "Localize", "robot=amigo_1", "area=tue_lab", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="session")
def trace_file(run_folder: Path) -> Path:
    """The trace of that run."""
    return run_folder / "trace.jsonl"


@pytest.fixture
def knowledge(tmp_path: Path) -> Path:
    """A copy of the shipped ontologies that a test may spoil."""
    folder = tmp_path / "ontologies"
    shutil.copytree(SHIPPED, folder)
    return folder
