"""The tests of the test set-up itself: what has to fail does fail."""

from pathlib import Path

import pytest

CONFTEST = Path(__file__).parent.parent / "conftest.py"

PLAIN = ("-p", "no:hypothesispytest", "-p", "no:cacheprovider")

PLT = """
:- module(canary_tests, []).
:- use_module(library(plunit)).
:- begin_tests(canary).
{tests}
:- end_tests(canary).
"""

# Tests in a file that has to fail, and what its report has to say.
BAD_TESTS = {
    "fails": ("test(fails) :- fail.", "failed"),
    "wrong_answer": ("test(wrong_answer, X == 2) :- X = 1.", "failed"),
    "throws": ("test(throws) :- atom_length(_, _).", "Arguments are not sufficiently instantiated"),
    "choice_point": ("test(choice_point) :- member(_, [a, b]).", "choicepoint"),
    "unknown_predicate": ("test(unknown_predicate) :- no_such_predicate(a).", "Unknown procedure"),
    "singleton": ("test(singleton) :- X = 1.", "Singleton"),
    "discontiguous": ("p(1).\nq(1).\np(2).\ntest(discontiguous) :- p(1), !, q(_).", "not together"),
    "syntax_error": ("test(good) :- true.\ntest(bad :- .", "Syntax error"),
    "blocked": ("test(good) :- true.\ntest(later, [blocked(not_yet)]) :- fail.", "not every test of the file ran"),
    "no_tests": ("", "not every test of the file ran"),
}


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """An empty project with our conftest.py."""
    monkeypatch.delenv("CONCERTMASTER_SHARED", raising=False)
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
    pytester.makeini("[pytest]\nmarkers = shared: canary\n")
    return pytester


def test_bad_plt_files_fail_each_for_its_reason(project: pytest.Pytester) -> None:
    """Failures, errors, warnings, left choice points and tests that never run all fail the file."""
    for name, (tests, _) in BAD_TESTS.items():
        project.path.joinpath(f"test_{name}.plt").write_text(PLT.format(tests=tests), encoding="utf-8")
    result = project.runpytest(*PLAIN)
    result.assert_outcomes(failed=len(BAD_TESTS))
    reports = result.stdout.str().split("plunit: test_")[1:]
    assert {report.split(".plt")[0] for report in reports} == set(BAD_TESTS)
    for report in reports:
        _, reason = BAD_TESTS[report.split(".plt")[0]]
        assert reason in report


def test_a_good_plt_file_passes_and_finds_rules_by_alias(project: pytest.Pytester) -> None:
    """A clean file passes; `kb_rules(...)` and `planner_golog(...)` name files of the repository."""
    for folder, name in (("kb/rules", "kb_canary"), ("planner/golog", "planner_canary")):
        project.path.joinpath(folder).mkdir(parents=True)
        source = f":- module({name}, [{name}/1]).\n{name}(1).\n"
        project.path.joinpath(folder, "canary.pl").write_text(source, encoding="utf-8")
    tests = """
:- use_module(kb_rules(canary), [kb_canary/1]).
:- use_module(planner_golog(canary), [planner_canary/1]).
test(both, X-Y == 1-1) :- kb_canary(X), planner_canary(Y).
"""
    project.path.joinpath("test_canary.plt").write_text(PLT.format(tests=tests), encoding="utf-8")
    project.runpytest(*PLAIN).assert_outcomes(passed=1)


def test_what_prolog_said_about_a_failure_is_shown(project: pytest.Pytester) -> None:
    """The report of a failed file names the plunit test."""
    project.path.joinpath("test_canary.plt").write_text(PLT.format(tests="test(the_name) :- fail."), encoding="utf-8")
    project.runpytest(*PLAIN).stdout.fnmatch_lines(["*the_name*"])


SHARED_TEST = """
import pytest

@pytest.mark.shared
def test_reads(shared):
    {body}
"""


def test_without_development_files_a_shared_test_skips(project: pytest.Pytester) -> None:
    """It skips, and says which variable is unset."""
    project.makepyfile(SHARED_TEST.format(body="assert False"))
    result = project.runpytest(*PLAIN, "-rs")
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines(["*CONCERTMASTER_SHARED is not set*"])


def test_with_development_files_a_missing_file_fails(project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the files are said to be there, a missing one is a failure."""
    monkeypatch.setenv("CONCERTMASTER_SHARED", str(project.path))
    project.makepyfile(SHARED_TEST.format(body="(shared / 'absent').read_text()"))
    project.runpytest(*PLAIN).assert_outcomes(failed=1)


def test_with_development_files_a_skip_fails(project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the files are said to be there, a skip is a failure."""
    monkeypatch.setenv("CONCERTMASTER_SHARED", str(project.path))
    project.makepyfile(SHARED_TEST.format(body="pytest.skip('not today')"))
    project.runpytest(*PLAIN).assert_outcomes(failed=1)


def test_golden_files_are_compared_and_rewritten_only_on_request(project: pytest.Pytester) -> None:
    """A missing or different golden file fails; `--update-golden` writes it, and then it passes."""
    project.makepyfile("""
        from pathlib import Path

        def test_text(golden):
            golden(Path(__file__).parent / "golden.txt", "one\\ntwo\\n")
    """)
    project.runpytest(*PLAIN).assert_outcomes(failed=1)
    project.runpytest(*PLAIN, "--update-golden").assert_outcomes(passed=1)
    project.runpytest(*PLAIN).assert_outcomes(passed=1)
    project.path.joinpath("golden.txt").write_text("one\nthree\n", encoding="utf-8")
    result = project.runpytest(*PLAIN)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*-three*"])
