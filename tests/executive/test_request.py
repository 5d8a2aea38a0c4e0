"""Stage 1: what is accepted, and how what is not is told."""

from __future__ import annotations

import pytest

from executive.errors import BadRequest
from executive.request import TaskRequest, check_request
from kb.store import Snapshot

SEARCH = {"robot": "amigo_1", "area": "tue_lab", "drink": "drink_1", "location": "at_coffee_table"}
NAVIGATE = {"robot": "amigo_1", "area": "tue_lab", "location": "at_bar"}


def test_left_out_the_limit_is_all_robots(snapshot: Snapshot) -> None:
    """Two robots are at the site."""
    request = check_request("FindEmptyDrink", {"room": "tue_lab"}, None, snapshot)
    assert request == TaskRequest(process="FindEmptyDrink", arguments={"room": "tue_lab"}, robots=2)


@pytest.mark.parametrize("robots", [1, 2, 50])
def test_the_limit_may_be_any_whole_number_from_1(snapshot: Snapshot, robots: int) -> None:
    """It is an upper limit: more than there are does no harm."""
    assert check_request("FindEmptyDrink", {"room": "kitchen"}, robots, snapshot).robots == robots


def test_individuals_of_subclasses_are_right(snapshot: Snapshot) -> None:
    """drink_1 is a Beer, which is a Drink; tue_lab is a Site, which is an Area; amigo_1 an Amigo, a Robot."""
    assert snapshot.ontology.kind_of("drink_1") != "Drink"
    assert check_request("SearchDrink", SEARCH, None, snapshot).arguments == SEARCH


def test_arguments_come_in_the_order_of_the_parameters(snapshot: Snapshot) -> None:
    """However they were given, so that the same request has the same trace."""
    backward = dict(reversed(NAVIGATE.items()))
    assert list(check_request("Navigate", backward, None, snapshot).arguments) == ["robot", "area", "location"]


@pytest.mark.parametrize(
    ("process", "arguments", "robots", "culprit", "told"),
    [
        ("", {}, None, "", "no task type ''; there is "),
        ("findemptydrink", {}, None, "findemptydrink", "no task type 'findemptydrink'; did you mean FindEmptyDrink?"),
        ("Navigate", {}, None, "robot", "needs the argument 'robot', a Robot; it takes robot (a Robot)"),
        ("Navigate", {**NAVIGATE, "speed": "9"}, None, "speed", "has no argument 'speed'; it takes robot (a Robot)"),
        (
            "Navigate",
            {**NAVIGATE, "robot": "pico_2"},
            None,
            "robot",
            "'pico_2' of Navigate is not known; did you mean pico_1",
        ),
        (
            "Navigate",
            {**NAVIGATE, "robot": "at_bar"},
            None,
            "robot",
            "is a SearchLocation, not a Robot; a Robot is amigo_1, pico_1",
        ),
        ("Navigate", {**NAVIGATE, "location": ""}, None, "location", "location='' of Navigate is not known"),
        ("Navigate", {**NAVIGATE, "location": None}, None, "location", "is a NoneType; give the name of a Location"),
        ("Navigate", {**NAVIGATE, "location": ["at_bar"]}, None, "location", "is a list; give the name of a Location"),
        ("Navigate", {**NAVIGATE, "robot": "Robot"}, None, "robot", "robot='Robot' of Navigate is not known"),
        ("SearchDrink", {**SEARCH, "location": "start_west"}, None, "location", "is a Location, not a SearchLocation"),
        ("SearchDrink", {**SEARCH, "drink": "coffee_table"}, None, "drink", "not a Drink"),
        ("Base", {"robot": "amigo_1", "velocity": "fast"}, None, "velocity", "which only another step can make"),
        (
            "Laser",
            {"robot": "amigo_1", "scan": "x"},
            None,
            "scan",
            "Laser has no argument 'scan'; it takes robot (a Robot)",
        ),
        ("FindEmptyDrink", {"room": "kitchen"}, 0, "robots", "robots=0 is no upper limit"),
        ("FindEmptyDrink", {"room": "kitchen"}, -3, "robots", "robots=-3 is no upper limit"),
        ("FindEmptyDrink", {"room": "kitchen"}, True, "robots", "robots=True is no upper limit"),
        ("FindEmptyDrink", {"room": "kitchen"}, 2.0, "robots", "robots=2.0 is no upper limit"),
        (
            "FindEmptyDrink",
            {"room": "kitchen"},
            "2",
            "robots",
            "robots='2' is no upper limit of robots; give a number from 1 to 2",
        ),
    ],
)
def test_what_is_wrong_is_told_with_the_culprit(
    snapshot: Snapshot, process: str, arguments: dict[str, object], robots: object, culprit: str, told: str
) -> None:
    """Never anything but BadRequest, and the fault is the request's."""
    with pytest.raises(BadRequest) as caught:
        check_request(process, arguments, robots, snapshot)
    assert told in str(caught.value)
    assert (caught.value.culprit, caught.value.fault) == (culprit, "request")
