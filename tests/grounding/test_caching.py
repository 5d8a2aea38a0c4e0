"""Known results: what counts as the same request, what the reply then says, and what is never kept."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

import pytest

from grounding.caching import CacheCount, Caching
from grounding.compute import registry
from grounding.compute.settings import CacheSettings
from grounding.kept import InMemory, OnDisk
from grounding.messages import OccupancyGrid, PoseStamped, header, pose_stamped, problem_with, stamp_s
from grounding.messages import Path as PathMessage
from grounding.runner import Fields, answer, settle
from grounding.timeless import from_bytes, to_bytes
from kb.errors import ServiceFailed
from kb.files import SHIPPED

_SITE = SHIPPED / "sites" / "tue_lab"
_MAP = "/compute/nav_map"
_COPY = "/compute/copy"


class Counting:
    """Runs services here, and knows how often; calls end at once, or when they are let go."""

    def __init__(self, *, at_once: bool = True) -> None:
        self.calls: list[str] = []
        self._waiting: list[Callable[[], None]] = []
        self._at_once = at_once

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        self.calls.append(service)
        ended = Future[Fields]()
        self._waiting.append(lambda: settle(ended, answer(service, fields, t_s)))
        if self._at_once:
            self.let_go()
        return ended

    def let_go(self) -> None:
        while self._waiting:
            self._waiting.pop(0)()

    def close(self) -> None:
        """Nothing runs."""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A site with maps, which may be changed."""
    shutil.copytree(_SITE, tmp_path / "site")
    return tmp_path / "site"


def _caching(runner: Counting, tmp_path: Path, *on_disk: str) -> Caching:
    caching = Caching(runner, CacheSettings(on_disk=on_disk), tmp_path / "results")
    caching.may_keep({_MAP})
    return caching


def _asked(site: Path, radius_m: float = 0.35) -> dict[str, object]:
    return {"map_file": str(site / "navMap.yaml"), "radius_m": radius_m}


def _map(caching: Caching, site: Path, t_s: float = 1.0, radius_m: float = 0.35) -> OccupancyGrid:
    found = caching.submit(_MAP, _asked(site, radius_m), t_s=t_s, timeout_s=60.0).result(timeout=10.0)["map"]
    assert isinstance(found, OccupancyGrid)
    return found


def test_an_equal_request_is_computed_once_and_answered_as_of_now(site: Path, tmp_path: Path) -> None:
    """The reply is as good as new: it has the stamp of its own call, and is otherwise the same."""
    caching = _caching(runner := Counting(), tmp_path)
    first, second = _map(caching, site, 1.0), _map(caching, site, 7.5)
    assert runner.calls == [_MAP]
    assert (stamp_s(first.header.stamp), stamp_s(second.header.stamp)) == (1.0, 7.5)
    fresh = Counting().submit(_MAP, _asked(site), t_s=7.5, timeout_s=1.0).result()
    assert repr(second) == repr(fresh["map"])
    assert caching.counts() == {_MAP: CacheCount(hits=1, misses=1)}


def test_other_inputs_are_another_request(site: Path, tmp_path: Path) -> None:
    """Another field; another content of the file that is named, or of the picture that it names."""
    caching = _caching(runner := Counting(), tmp_path)
    _map(caching, site)
    _map(caching, site, radius_m=0.36)
    assert len(runner.calls) == 2
    file = site / "navMap.yaml"
    file.write_text(file.read_text() + "# changed\n")
    _map(caching, site)
    assert len(runner.calls) == 3
    picture = registry.files_read(_MAP, file)[1]
    picture.write_bytes(picture.read_bytes()[:-1] + b"\x07")
    for _ in range(2):
        _map(caching, site)
    assert len(runner.calls) == 4


def test_what_may_not_be_kept_is_computed_each_time(site: Path, tmp_path: Path) -> None:
    """As the knowledge says of a service, and may no longer say after a change."""
    caching = _caching(runner := Counting(), tmp_path)
    _map(caching, site)
    caching.may_keep(frozenset())
    _map(caching, site)
    assert len(runner.calls) == 2
    assert caching.counts() == {_MAP: CacheCount(misses=1)}


def test_results_on_disk_are_there_in_the_next_run(site: Path, tmp_path: Path) -> None:
    """Those that the settings name; read once, they are in memory too."""
    _map(_caching(Counting(), tmp_path, _MAP), site)
    _map(caching := _caching(runner := Counting(), tmp_path, _MAP), site, 5.0)
    shutil.rmtree(tmp_path / "results")
    assert stamp_s(_map(caching, site, 6.0).header.stamp) == 6.0
    assert (runner.calls, caching.counts()) == ([], {_MAP: CacheCount(hits=2)})


def test_other_code_is_another_request(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an older version has computed is not taken for what this one would."""
    _map(_caching(Counting(), tmp_path, _MAP), site)
    monkeypatch.setattr("grounding.caching.code_of", lambda service: "of another version")
    _map(_caching(runner := Counting(), tmp_path, _MAP), site)
    assert runner.calls == [_MAP]


def test_a_damaged_result_is_computed_again(site: Path, tmp_path: Path) -> None:
    """And mended, whether its bytes are damaged or whole but no fields; it is no error."""
    first = _map(_caching(Counting(), tmp_path, _MAP), site)
    [file] = (tmp_path / "results").iterdir()
    for damage in (
        lambda: file.write_bytes(file.read_bytes()[:-1]),
        lambda: file.write_bytes(b""),
        lambda: OnDisk(tmp_path / "results", 1000).put(file.name, b"\x01"),
    ):
        damage()
        assert repr(_map(_caching(runner := Counting(), tmp_path, _MAP), site)) == repr(first)
        assert runner.calls == [_MAP]
        _map(_caching(after := Counting(), tmp_path, _MAP), site)
        assert after.calls == []


def test_equal_calls_at_once_compute_once(site: Path, tmp_path: Path) -> None:
    """Who comes while it runs waits for it, and gets it with the stamp of the own call."""
    caching = _caching(runner := Counting(at_once=False), tmp_path)
    calls = [caching.submit(_MAP, _asked(site), t_s=float(n), timeout_s=60.0) for n in range(3)]
    assert not any(call.done() for call in calls)
    runner.let_go()
    assert [call.result(timeout=10.0)["map"].header.stamp.sec for call in calls] == [0, 1, 2]  # type: ignore[attr-defined]
    assert (runner.calls, caching.counts()) == ([_MAP], {_MAP: CacheCount(hits=2, misses=1)})


def test_failures_are_told_to_all_who_wait_and_not_kept(tmp_path: Path) -> None:
    """It may go well the next time."""
    caching = _caching(runner := Counting(at_once=False), tmp_path)
    (tmp_path / "navMap.yaml").write_text("image: none.pgm\n")
    (tmp_path / "none.pgm").touch()
    calls = [caching.submit(_MAP, _asked(tmp_path), t_s=0.0, timeout_s=60.0) for _ in range(2)]
    runner.let_go()
    for call in calls:
        assert isinstance(call.exception(timeout=10.0), ServiceFailed)
    caching.submit(_MAP, _asked(tmp_path), t_s=0.0, timeout_s=60.0)
    assert runner.calls == [_MAP, _MAP]


def test_what_cannot_be_compared_or_kept_is_left_to_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that is not there, a value or a reply without bytes: as without a cache, also for who waits."""
    monkeypatch.setitem(registry._OURS, _COPY, lambda *, value, t_s: {"set": {value}})
    caching = _caching(runner := Counting(at_once=False), tmp_path)
    caching.may_keep({_MAP, _COPY})
    lost = caching.submit(_MAP, _asked(tmp_path), t_s=0.0, timeout_s=1.0)
    odd = caching.submit(_COPY, {"value": frozenset()}, t_s=0.0, timeout_s=1.0)
    same = [caching.submit(_COPY, {"value": 3}, t_s=0.0, timeout_s=1.0) for _ in range(2)]
    runner.let_go()
    assert isinstance(lost.exception(timeout=10.0), ServiceFailed)
    assert odd.result(timeout=10.0) == {"set": {frozenset()}}
    assert [call.result(timeout=10.0) for call in same] == [{"set": {3}}] * 2


def test_stamps_of_other_times_tell_requests_apart() -> None:
    """A pose of now is the same as a pose of now then; one of a while ago is not, and keeps its stamp."""

    def data(pose_s: float, t_s: float) -> bytes:
        return to_bytes({"pose": pose_stamped(1.0, 2.0, 0.0, t_s=pose_s)}, t_s)

    assert data(1.0, 1.0) == data(2.0, 2.0) != data(1.0, 2.0)
    for pose_s, as_of_9_s in ((7.0, 9.0), (6.0, 6.0)):
        back = from_bytes(data(pose_s, 7.0), 9.0)["pose"]
        assert isinstance(back, PoseStamped)
        assert stamp_s(back.header.stamp) == as_of_9_s


def test_memory_and_disk_forget_what_was_not_used_for_longest(tmp_path: Path) -> None:
    """When there is no more room; what is larger than all room is not kept at all."""
    memory, disk = InMemory(300), OnDisk(tmp_path / "kept", 3 * 132)
    for kept in (memory, disk):
        for key in "abc":
            kept.put(key, bytes(100))
        assert kept.get("a") is not None
        kept.put("d", bytes(100))
        assert kept.get("b") is None
        assert kept.get("d") is not None
        kept.put("large", bytes(1000))
        assert kept.get("large") is None


def test_a_message_of_messages_comes_back_whole() -> None:
    """Its lists are lists again, whatever they are in the bytes."""
    asked = {"path": PathMessage(header=header("map", 1.0), poses=[pose_stamped(0.1, -0.0, 1.0, t_s=1.0)])}
    back = from_bytes(to_bytes(asked, 2.0), 2.0)
    assert problem_with("nav_msgs/Path", back["path"]) == ""
    assert back == asked
