"""Where things stand, how they are named, how large they may be, who may import whom."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("kb", "planner", "grounding", "executive", "sim")
MODULES = sorted(
    file.relative_to(ROOT)
    for package in PACKAGES
    for file in (ROOT / package).rglob("*")
    if file.suffix in {".py", ".pl"}
)
LINE_LIMITS = {".py": 500, ".pl": 300}
FORBIDDEN_NAMES = {"utils", "util", "common", "helpers", "helper", "manager", "managers", "base", "misc"}


def test_there_are_modules_to_check() -> None:
    """The folders were found: the tests below check something."""
    assert {module.parts[0] for module in MODULES} == set(PACKAGES)


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_a_module_is_short(module: Path) -> None:
    """A module that can be read in one go: 500 lines of Python, 300 of Prolog."""
    lines = len((ROOT / module).read_text(encoding="utf-8").splitlines())
    limit = LINE_LIMITS[module.suffix]
    assert lines <= limit, f"{module} has {lines} lines, {limit} are allowed: split it"


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_a_module_is_named_for_what_it_owns(module: Path) -> None:
    """No `utils`, `common`, `helpers`, `manager`, `base`, as a file or as a folder."""
    names = {part.removesuffix(module.suffix) for part in module.parts}
    assert not names & FORBIDDEN_NAMES, f"{module}: name it for the noun it owns"


def test_packages_import_in_one_direction() -> None:
    """The import-linter contracts of pyproject.toml are kept."""
    linter = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([linter], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


IMPORT_EACH = """
import importlib, os, sys, threading

before = dict(os.environ)
for name in sys.argv[1:]:
    importlib.import_module(name)
    assert "pyswip" not in sys.modules, f"importing {name} starts SWI-Prolog"
    assert threading.active_count() == 1, f"importing {name} starts a thread"
    assert dict(os.environ) == before, f"importing {name} changes the environment"
"""


def test_importing_a_module_does_nothing() -> None:
    """An import prints nothing and starts nothing: no Prolog, no thread, no changed environment."""
    names = [
        ".".join(module.with_suffix("").parts).removesuffix(".__init__")
        for module in MODULES
        if module.suffix == ".py" and module.stem != "__main__"
    ]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", IMPORT_EACH, *names],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
