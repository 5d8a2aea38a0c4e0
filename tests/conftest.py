"""What all tests share: Prolog test files, golden files, development files outside the repository."""

from __future__ import annotations

import difflib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from grounding.ros1.installed import ros
from kb.errors import DependencyMissing
from tests.contracts.ros_master import RosMaster

SHARED_VARIABLE = "CONCERTMASTER_SHARED"
SWIPL_TIMEOUT_S = 120.0

Swipl = Callable[..., subprocess.CompletedProcess[str]]
Golden = Callable[[Path, str], None]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--update-golden`."""
    parser.addoption("--update-golden", action="store_true", help="rewrite golden files instead of comparing")


# ------------------------------------------------------------------------------- Prolog test files


def run_swipl(root: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a `swipl` that fails on any error or warning and knows the search-path aliases below `root`."""
    # Where `make setup` had to unpack SWI-Prolog, its command is beside Python's.
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)))
    swipl = shutil.which("swipl", path=path)
    if swipl is None:
        pytest.fail("swipl is not on PATH: run `make setup`", pytrace=False)
    aliases = ("-p", f"kb_rules={root / 'kb' / 'rules'}", "-p", f"planner_golog={root / 'planner' / 'golog'}")
    return subprocess.run(
        [swipl, "--on-error=status", "--on-warning=status", *aliases, *arguments],
        capture_output=True,
        text=True,
        timeout=SWIPL_TIMEOUT_S,
        stdin=subprocess.DEVNULL,
        check=False,
    )


@pytest.fixture(scope="session")
def swipl(pytestconfig: pytest.Config) -> Swipl:
    """`run_swipl` for this repository."""
    return partial(run_swipl, pytestconfig.rootpath)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect `*.plt`: plunit files, each one test in a process of its own."""
    if file_path.suffix == ".plt":
        return PltFile.from_parent(parent, path=file_path)
    return None


class PltFile(pytest.File):
    """A file of plunit tests."""

    def collect(self) -> Iterator[pytest.Item]:
        yield PltItem.from_parent(self, name="plunit")


class PltFailed(Exception):
    """What `swipl` said about a file that did not pass."""


class PltItem(pytest.Item):
    """All plunit tests of one file. A failure, an error, a warning or a left choice point fails it."""

    def runtest(self) -> None:
        done = run_swipl(self.config.rootpath, "-g", "run_tests", "-t", "halt", str(self.path))
        output = done.stdout + done.stderr
        self.add_report_section("call", "plunit", output)
        if done.returncode != 0:
            raise PltFailed(f"swipl ended with status {done.returncode}:\n{output}")
        # A file whose tests were not found passes as well as one whose tests all hold.
        if not re.search(r"^% (All \d+ tests|test) passed", output, re.MULTILINE):
            raise PltFailed(f"not every test of the file ran and passed:\n{output}")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, PltFailed):
            return f"{self.path}\n{excinfo.value}"
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        return self.path, 0, f"plunit: {self.path.name}"


# ------------------------------------------------------------------------------------ golden files


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """A function of (file, text) that compares the two; `--update-golden` writes the file instead."""

    def check(file: Path, actual: str) -> None:
        if request.config.getoption("--update-golden"):
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(actual, encoding="utf-8")
            return
        if not file.is_file():
            pytest.fail(f"{file}: no such golden file; `pytest --update-golden` writes it", pytrace=False)
        expected = file.read_text(encoding="utf-8")
        if expected != actual:
            difference = difflib.unified_diff(
                expected.splitlines(), actual.splitlines(), fromfile=str(file), tofile="actual", lineterm="", n=2
            )
            lines = "\n".join(list(difference)[:80]) or "they differ only in line ends"
            pytest.fail(f"{lines}\n(`pytest --update-golden` rewrites the file: review it like code)", pytrace=False)

    return check


# ------------------------------------------------------------------------------------------- ROS 1


@pytest.fixture(scope="session")
def ros_master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RosMaster]:
    """The master of this process's ROS 1 node, of which rospy has one for good; for tests marked `ros1`."""
    folder = tmp_path_factory.mktemp("ros")
    with RosMaster(folder) as master:
        os.environ["ROS_HOME"] = str(folder)
        yield master
        with suppress(DependencyMissing):
            ros("rospy").signal_shutdown("the tests are over")


# ----------------------------------------------------------- development files outside the repository


@pytest.fixture
def shared() -> Path:
    """The folder of development files; for tests marked `shared`."""
    return Path(os.environ[SHARED_VARIABLE])


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip tests marked `shared` where there are no development files."""
    if item.get_closest_marker("shared") and SHARED_VARIABLE not in os.environ:
        pytest.skip(f"{SHARED_VARIABLE} is not set: no development files here")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Where the development files are said to be there, a skip is a failure."""
    report = yield
    if report.skipped and item.get_closest_marker("shared") and SHARED_VARIABLE in os.environ:
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid} skipped although {SHARED_VARIABLE} is set: {reason}"
    return report
