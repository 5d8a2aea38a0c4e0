"""The compute services by name: what they take, and what they refuse."""

from __future__ import annotations

import pytest

from grounding.inprocess import InProcessTransport
from grounding.messages import OccupancyGrid
from grounding.runner import compute, compute_services
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import SimClock
from kb.errors import ServiceFailed
from kb.files import SHIPPED

MAP_FILE = str(SHIPPED / "sites" / "tue_lab" / "navMap.yaml")


def test_a_service_runs_with_files_given_by_name() -> None:
    """Fields named `..._file` are texts on the wire; the time is that of the call."""
    found = compute("/compute/nav_map", {"map_file": MAP_FILE, "radius_m": 0.35}, t_s=2.5)["map"]
    assert isinstance(found, OccupancyGrid)
    assert (found.header.frame_id, found.header.stamp.sec) == ("map", 2)


@pytest.mark.parametrize(
    ("service", "fields", "code", "told"),
    [
        (
            "/compute/dance",
            {},
            "NoSuchService",
            "there is no /compute/dance; there is /compute/compare, /compute/copy",
        ),
        ("compute/nav_map", {}, "NoSuchService", "there is no compute/nav_map"),
        (
            "/compute/nav_map",
            {"map_file": MAP_FILE},
            "BadInput",
            "/compute/nav_map takes the fields map_file, radius_m; given: map_file",
        ),
        (
            "/compute/loc_map",
            {"map_file": MAP_FILE, "radius_m": 0.3},
            "BadInput",
            "/compute/loc_map takes the fields map_file; given: map_file, radius_m",
        ),
        ("/compute/loc_map", {"map_file": MAP_FILE, "t_s": 1.0}, "BadInput", "given: map_file, t_s"),
        ("/compute/loc_map", {"map_file": "nowhere.yaml"}, "BadInput", "nowhere.yaml"),
    ],
)
def test_what_is_asked_wrongly_fails_with_names(service: str, fields: dict[str, object], code: str, told: str) -> None:
    """The service, the fields that it takes, and those given."""
    with pytest.raises(ServiceFailed) as caught:
        compute(service, fields, t_s=0.0)
    assert caught.value.code == code
    assert told in caught.value.message


def test_services_take_as_long_as_they_are_said_to() -> None:
    """Under simulated time; names without a service, such as those of robots, are not offered."""
    clock, replies = SimClock(), list[tuple[float, ServiceReply]]()
    offered = compute_services(clock, {"/compute/nav_map": 0.25, "/r1/laser": 1.0})
    assert list(offered) == ["/compute/nav_map"]
    transport = InProcessTransport(clock)
    transport.offer("/compute/nav_map", offered["/compute/nav_map"])
    fields = {"map_file": MAP_FILE, "radius_m": 0.35}
    for number, given in ((1, fields), (2, {})):
        call = ServiceCall(id=number, service="/compute/nav_map", fields=given, timeout_s=1.0)
        at_s = 3.0 * number
        clock.call_at(at_s, lambda call=call: transport.call(call, lambda r: replies.append((clock.now_s, r))))  # type: ignore[misc]
    clock.run_until(lambda: False)
    (first_s, good), (second_s, bad) = replies
    assert (first_s, second_s) == (3.25, 6.25)
    assert isinstance(good.fields["map"], OccupancyGrid)
    assert good.fields["map"].header.stamp.sec == 3, "made at the time of the call"
    assert (bad.failure, bad.fields) == ("BadInput", {})
