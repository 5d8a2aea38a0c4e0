"""Clocks: what runs when, and in which order."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kb.clock import Clock, SimClock, WallClock


def exhaust(clock: Clock) -> None:
    """Run everything there is."""
    assert clock.run_until(lambda: False) is False


@given(st.lists(st.integers(0, 5), max_size=20))
def test_callbacks_run_by_time_and_equal_times_in_order_of_arrival(times: list[int]) -> None:
    """Whatever the order in which they were asked for."""
    clock, ran = SimClock(), list[tuple[float, int]]()
    for number, t_s in enumerate(times):
        clock.call_at(t_s, lambda number=number: ran.append((clock.now_s, number)))  # type: ignore[misc]
    exhaust(clock)
    assert ran == sorted((float(t_s), number) for number, t_s in enumerate(times))


def test_time_stands_still_while_nothing_happens() -> None:
    """It jumps from one callback to the next, and stays at the last."""
    clock = SimClock()
    assert clock.now_s == 0.0
    clock.call_at(3.5, lambda: None)
    assert clock.now_s == 0.0
    exhaust(clock)
    assert clock.now_s == 3.5


def test_what_is_done_already_takes_no_time() -> None:
    """No callback runs once `done()`."""
    clock, ran = SimClock(), list[int]()
    clock.call_at(1.0, lambda: ran.append(1))
    assert clock.run_until(lambda: True)
    assert (ran, clock.now_s) == ([], 0.0)
    clock.call_at(1.0, lambda: ran.append(2))
    assert clock.run_until(lambda: bool(ran))
    assert ran == [1]


def test_callbacks_may_ask_for_callbacks() -> None:
    """Also for now: they run after those that were asked for earlier."""
    clock, ran = SimClock(), list[str]()

    def first() -> None:
        ran.append("first")
        clock.call_at(clock.now_s, lambda: ran.append("third"))

    clock.call_at(1.0, first)
    clock.call_at(1.0, lambda: ran.append("second"))
    exhaust(clock)
    assert ran == ["first", "second", "third"]


def test_followers_are_there_before_the_callbacks() -> None:
    """The simulator is advanced first, in the order of following, and sees the time that is to come."""
    clock, told = SimClock(), list[tuple[str, float, float]]()
    clock.follow(lambda t_s: told.append(("one", t_s, clock.now_s)))
    clock.follow(lambda t_s: told.append(("two", t_s, clock.now_s)))
    clock.call_at(2.0, lambda: told.append(("callback", 2.0, clock.now_s)))
    exhaust(clock)
    assert told == [("one", 2.0, 0.0), ("two", 2.0, 0.0), ("callback", 2.0, 2.0)]


def test_the_past_is_refused() -> None:
    """The present is not."""
    clock = SimClock()
    clock.call_at(1.0, lambda: None)
    exhaust(clock)
    with pytest.raises(ValueError, match=r"call_at\(0\.5\): the time is already 1\.0"):
        clock.call_at(0.5, lambda: None)
    clock.call_at(1.0, lambda: None)
    exhaust(clock)


def test_simulated_time_ticks_in_nanoseconds() -> None:
    """A thousand steps of 0.1 s end at 100 s, not beside it; half a nanosecond into the past is now."""
    clock, left = SimClock(), 1000

    def tick() -> None:
        nonlocal left
        left -= 1
        if left:
            clock.call_at(clock.now_s + 0.1, tick)

    clock.call_at(0.1, tick)
    exhaust(clock)
    assert clock.now_s == 100.0
    clock.call_at(clock.now_s - 4e-10, lambda: None)
    exhaust(clock)
    assert clock.now_s == 100.0


def test_the_wall_clock_runs_callbacks_in_order_and_not_too_early() -> None:
    """Real delays of at most 20 ms; a time that is past already is run at once."""
    clock, ran = WallClock(), list[tuple[str, float]]()

    def note(name: str) -> Callable[[], None]:
        return lambda: ran.append((name, clock.now_s))

    start_s = clock.now_s
    clock.call_at(start_s + 0.02, note("last"))
    clock.call_at(start_s + 0.01, note("middle"))
    clock.call_at(start_s + 0.01, note("middle too"))
    clock.call_at(start_s - 1.0, note("first"))
    exhaust(clock)
    assert [name for name, _ in ran] == ["first", "middle", "middle too", "last"]
    for (_, t_s), due_s in zip(ran, (0.0, 0.01, 0.01, 0.02), strict=True):
        assert t_s >= start_s + due_s


def test_the_wall_clock_goes_on_by_itself_and_stops_when_done() -> None:
    """Its time never goes back; what is done runs no callback."""
    clock, ran = WallClock(), list[int]()
    before_s = clock.now_s
    clock.call_at(before_s + 0.005, lambda: ran.append(1))
    clock.call_at(before_s + 60.0, lambda: ran.append(2))
    assert clock.run_until(lambda: bool(ran))
    assert ran == [1]
    assert clock.now_s >= before_s + 0.005


def test_another_thread_wakes_the_wall_clock() -> None:
    """What it posts runs at once on the thread of the clock, though the next callback is far away."""
    clock, ran = WallClock(), list[int]()
    clock.call_at(clock.now_s + 60.0, lambda: ran.append(-1))
    thread = threading.Thread(target=lambda: clock.post(lambda: ran.append(threading.get_ident())))
    clock.post(thread.start)
    assert clock.run_until(lambda: bool(ran))
    thread.join()
    assert ran == [threading.get_ident()]
    assert clock.now_s < 30.0


def test_the_wall_clock_goes_on_while_somebody_listens() -> None:
    """It ends when the last has stopped listening; to stop twice counts once."""
    clock, ran = WallClock(), list[int]()
    stop_first, stop_second = clock.listen(), clock.listen()

    def stop() -> None:
        stop_first()
        stop_first()
        clock.post(lambda: ran.append(1))
        stop_second()

    thread = threading.Thread(target=stop)
    clock.post(thread.start)
    exhaust(clock)
    thread.join()
    assert ran == [1]


def test_callbacks_of_many_threads_all_run_on_the_thread_of_the_wall_clock() -> None:
    """Each thread's in its order."""
    clock, ran = WallClock(), list[tuple[int, int, int]]()

    def post(thread: int) -> None:
        for number in range(100):
            clock.post(lambda number=number: ran.append((thread, number, threading.get_ident())))  # type: ignore[misc]

    threads = [threading.Thread(target=post, args=(name,)) for name in range(4)]
    end = clock.listen()
    for thread in threads:
        thread.start()
    assert clock.run_until(lambda: len(ran) == 400)
    end()
    for thread in threads:
        thread.join()
    assert {ident for _, _, ident in ran} == {threading.get_ident()}
    for name in range(4):
        assert [number for of, number, _ in ran if of == name] == list(range(100))


def test_a_time_beyond_all_waiting_is_waited_for() -> None:
    """Never is a time as well."""
    clock, ran = WallClock(), list[int]()
    clock.call_at(float("inf"), lambda: ran.append(1))
    clock.post(lambda: ran.append(2))
    assert clock.run_until(lambda: bool(ran))
    assert ran == [2]


@pytest.mark.parametrize("make", [SimClock, WallClock])
def test_what_is_withdrawn_is_as_if_it_had_never_been_asked_for(make: Callable[[], Clock]) -> None:
    """Nobody waits for it; to withdraw twice, or what has run, does nothing."""
    clock, ran = make(), list[int]()
    withdraw_late = clock.call_at(clock.now_s + 1000.0, lambda: ran.append(1))
    withdraw_first = clock.call_at(clock.now_s, lambda: ran.append(2))
    clock.call_at(clock.now_s, withdraw_late)
    clock.call_at(clock.now_s, lambda: ran.append(3))
    exhaust(clock)
    withdraw_first()
    withdraw_late()
    exhaust(clock)
    assert ran == [2, 3]
    assert clock.now_s < 1000.0
