"""A fleet may be opened in one thread and worked with in another."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from executive import Fleet, TaskStatus


def test_a_fleet_works_from_any_thread() -> None:
    """Opened in one thread, asked in a second, waited for in a third."""
    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(1) as two:
        fleet = one.submit(Fleet.open, "tue_lab").result()
        task = two.submit(fleet.request, "FindEmptyDrink", room="kitchen").result()
        assert one.submit(task.wait_until, 1.0).result() is None
        assert task.wait().status is TaskStatus.COMPLETED
        two.submit(fleet.close).result()
