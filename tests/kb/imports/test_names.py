"""Names of others are made names of ours."""

from __future__ import annotations

import pytest

from kb.imports.names import Names, local, parameter_name, safe, snake
from kb.imports.ordering import arrange


@pytest.mark.parametrize(
    ("text", "as_name", "as_parameter", "as_field"),
    [
        ("BookName", "BookName", "bookName", "book_name"),
        ("ISBN", "ISBN", "isbn", "isbn"),
        ("CP_BNPrice", "CP_BNPrice", "cp_BNPrice", "cp_bn_price"),
        ("HTTPServer", "HTTPServer", "httpServer", "http_server"),
        ("robotPose-grasping1", "robotPose_grasping1", "robotPose_grasping1", "robot_pose_grasping1"),
        ("3D model!", "n_3D_model", "n_3D_model", "n_3_d_model"),
        ("", "unnamed", "unnamed", "unnamed"),
        ("'; halt.", "halt", "halt", "halt"),
    ],
)
def test_safe(text: str, as_name: str, as_parameter: str, as_field: str) -> None:
    """Letters, digits and _ remain; parameters begin small, fields are small throughout."""
    assert (safe(text), parameter_name(text), snake(text)) == (as_name, as_parameter, as_field)


def test_each_once() -> None:
    """A name that is taken, by the core too, gets a number; the same thing keeps its name."""
    names = Names()
    assert [names.fresh("door"), names.fresh("door"), names.fresh("Robot")] == ["door", "door_2", "Robot_2"]
    assert names.of("http://a#x", "door") == names.of("http://a#x", "other") == "door_3"


def test_local() -> None:
    """The last part of an IRI, whatever separates it."""
    assert [local(i) for i in ("http://a/b#c", "http://a/b/c", "http://a/b/")] == ["c", "c", "b"]


def test_arrange() -> None:
    """Layers keep what was asked, and tell what they add."""
    arranged = arrange(["a", "b", "c", "d"], {("a", "b"), ("b", "c")})
    assert arranged.layers == [["a", "d"], ["b"], ["c"]]
    assert arranged.added == [("d", "b"), ("d", "c")]
    assert arrange(["a", "b"], {("a", "b"), ("b", "a")}).layers == [["a", "b"]]
