"""Compute services in processes of their own: several at once, each with limits, none able to take us down.

A worker that crashes, hangs or wants too much memory costs the call that it was working at; another takes its place.
Workers of a site see the variables of the environment that are meant for it, and no others.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
from concurrent.futures import CancelledError, Future
from concurrent.futures import TimeoutError as TimedOut
from threading import Lock

from pebble import ProcessExpired, ProcessPool

from grounding.compute.registry import is_compute_service
from grounding.compute.settings import WorkerSettings
from grounding.runner import Answer, Fields, answer, settle

_ALWAYS = ("PATH", "HOME", "LANG", "TMPDIR")
_MB = 1 << 20


class Workers:
    """A pool of processes; close it when done."""

    def __init__(self, settings: WorkerSettings) -> None:
        self._most_open = settings.count + settings.waiting
        self._lock = Lock()  # calls end on a thread of the pool
        self._open = set[Future[Answer]]()
        # Not forked: Prolog, Java and PyBullet do not survive that.
        self._pool = ProcessPool(
            max_workers=settings.count,
            context=multiprocessing.get_context("spawn"),
            initializer=_prepare,
            initargs=[settings.memory_mb, dict(settings.environment)],
        )

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        ended = Future[Fields]()
        if refusal := self._refusal_of(service):
            settle(ended, refusal)
            return ended
        running = self._pool.schedule(answer, args=[service, dict(fields), t_s], timeout=timeout_s)
        with self._lock:
            self._open.add(running)

        def end(done: Future[Answer]) -> None:
            with self._lock:
                self._open.discard(done)
            settle(ended, _answer_of(service, timeout_s, done))

        running.add_done_callback(end)
        return ended

    def close(self) -> None:
        """End all workers, whatever they are doing."""
        with self._lock:
            still_open = list(self._open)
        for running in still_open:
            running.cancel()
        self._pool.stop()
        self._pool.join()

    def _refusal_of(self, service: str) -> Answer | None:
        if not is_compute_service(service):
            return "failed", "NoSuchService", f"there is no {service}"
        with self._lock:
            if len(self._open) < self._most_open:
                return None
            told = f"{len(self._open)} calls are open, and no more than {self._most_open} may be"
            return "failed", "Busy", f"{service}: {told}"


def _answer_of(service: str, timeout_s: float, done: Future[Answer]) -> Answer:
    try:
        came = done.result()
    except TimedOut:
        return "failed", "TookTooLong", f"{service} was stopped after {timeout_s:g} s"
    except ProcessExpired as expired:
        told = f"its worker ended with exit code {expired.exitcode}; another has taken its place"
        return "failed", "WorkerDied", f"{service}: {told}"
    except CancelledError:
        return "failed", "WorkerDied", f"{service} was stopped: the workers are closed"
    return came


def _prepare(memory_mb: int, environment: dict[str, str]) -> None:
    leave_only(environment)
    resource.setrlimit(resource.RLIMIT_AS, (memory_mb * _MB, memory_mb * _MB))


def leave_only(environment: dict[str, str]) -> None:
    """In a new worker: take away the variables that are not meant for it."""
    kept = {name: os.environ[name] for name in _ALWAYS if name in os.environ}
    os.environ.clear()
    os.environ.update(kept | environment)
