"""Compute services on a Ray cluster: as workers of our own (workers.py), on whatever machines the cluster has.

Each worker is a Ray actor, a process that this site has for itself. Its memory and processors are reserved on the
cluster, and its memory is limited there as it is here. A worker that crashes, hangs or whose machine is lost costs the
call that it was working at, unless that may be tried again; another takes its place.

The machines of a cluster need the same packages, and the files of the site under the same names.
"""

from __future__ import annotations

import importlib.util
import math
import os
import pickle
import resource
import sys
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, Literal

from grounding.compute.registry import is_compute_service
from grounding.compute.settings import RaySettings, WorkerSettings
from grounding.runner import Answer, Fields, answer, settle
from grounding.workers import leave_only
from kb.errors import ConcertmasterError, DependencyMissing, ServiceFailed

_MB = 1 << 20
_STORE_MB = 256  # for what is on its way to and from workers; Ray would take a third of the machine


class NoCluster(ConcertmasterError):
    """There is no Ray cluster where one is said to be."""

    fault = "world"


class OnRay:
    """As many workers as there may be on a cluster, started as they are needed; close it when done."""

    def __init__(self, settings: RaySettings, workers: WorkerSettings) -> None:
        """Connect to the cluster, or start one on this machine.

        Raises:
            DependencyMissing: Ray is not installed.
            NoCluster: There is none at the address, or none can be started.
        """
        self._settings = settings
        self._workers = workers
        self._ray = _connection.open(settings, workers.count)
        self._lock = Lock()  # calls end on threads
        self._open = set[Future[Answer]]()
        self._idle = SimpleQueue[Any]()
        self._all = list[Any]()
        self._closed = False
        # A thread for each worker, which waits for it. A call that waits for a worker is not with Ray yet, so that the
        # time it waits does not count.
        self._threads = ThreadPoolExecutor(workers.count, thread_name_prefix="on_ray")

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        ended = Future[Fields]()
        if refusal := self._refusal_of(service):
            settle(ended, refusal)
            return ended
        running = self._threads.submit(self._call, service, dict(fields), t_s, timeout_s)
        with self._lock:
            self._open.add(running)

        def end(done: Future[Answer]) -> None:
            with self._lock:
                self._open.discard(done)
            try:
                settle(ended, done.result())
            except CancelledError:
                settle(ended, _closed(service))

        running.add_done_callback(end)
        return ended

    def close(self) -> None:
        """End all workers, whatever they are doing; the last to close ends the cluster that was started here."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            workers = list(self._all)
        for worker in workers:
            self._ray.kill(worker)
        self._threads.shutdown(cancel_futures=True)
        _connection.close(self._ray)

    def _refusal_of(self, service: str) -> Answer | None:
        if not is_compute_service(service):
            return "failed", "NoSuchService", f"there is no {service}"
        most_open = self._workers.count + self._workers.waiting
        with self._lock:
            if self._closed:
                return _closed(service)
            if len(self._open) < most_open:
                return None
            told = f"{len(self._open)} calls are open, and no more than {most_open} may be"
            return "failed", "Busy", f"{service}: {told}"

    def _call(self, service: str, fields: Fields, t_s: float, timeout_s: float) -> Answer:
        """Have a worker do it; again if the worker dies, as often as that may be. Runs on a thread of its own."""
        errors = self._ray.exceptions
        for _ in range(1 + self._settings.retries):
            worker = None
            try:
                worker = self._worker(service)
                came = self._ray.get(worker.run.remote(service, fields, t_s), timeout=timeout_s)
                self._idle.put(worker)
                return pickle.loads(came)  # type: ignore[no-any-return]
            except ServiceFailed as failed:
                return "failed", failed.code, failed.message
            except errors.GetTimeoutError:
                self._end(worker)
                return "failed", "TookTooLong", f"{service} was stopped after {timeout_s:g} s"
            except errors.OutOfMemoryError:
                self._end(worker)
                return "failed", "OutOfMemory", f"{service} needs more memory than there is on its machine"
            except errors.RayActorError:
                self._end(worker)
                if self._closed:
                    return _closed(service)
            except errors.RayError as error:  # the cluster itself is in trouble
                self._end(worker)
                return "failed", "WorkerDied", f"{service}: {' '.join(str(error).split())[:200]}"
        return "failed", "WorkerDied", f"{service}: its worker ended; another has taken its place"

    def _worker(self, service: str) -> Any:
        """One that has nothing to do, or a new one.

        Raises:
            ServiceFailed: There can be none.
        """
        try:
            return self._idle.get_nowait()
        except Empty:
            pass
        limits = {"num_cpus": self._settings.cpus, "memory": self._workers.memory_mb * _MB}
        with self._lock:
            if self._closed:
                raise ServiceFailed(*_closed(service)[1:])
            worker = (
                self._ray.remote(_Worker)
                .options(**limits)
                .remote(self._workers.memory_mb, dict(self._workers.environment))
            )
            self._all.append(worker)
        try:
            self._ray.get(worker.ready.remote(), timeout=self._settings.start_s)
        except self._ray.exceptions.GetTimeoutError:
            self._end(worker)
            asked = f"{self._settings.cpus:g} processors and {self._workers.memory_mb} MB"
            told = f"the cluster has had no room for a worker of {asked} for {self._settings.start_s:g} s"
            raise ServiceFailed("Busy", f"{service}: {told}") from None
        return worker

    def _end(self, worker: Any) -> None:
        if worker is None:
            return
        self._ray.kill(worker)
        with self._lock:
            self._all.remove(worker)


class _Worker:
    """What runs on the cluster."""

    def __init__(self, memory_mb: int, environment: dict[str, str]) -> None:
        # Ray maps memory that all workers share before we come; that does not count.
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * resource.getpagesize() + memory_mb * _MB
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        leave_only(environment)

    def ready(self) -> None:
        """Answers once the worker has started."""

    def run(self, service: str, fields: Fields, t_s: float) -> bytes:
        """Compute; the answer is pickled here, so that its arrays do not lie in memory that ends with the cluster."""
        try:
            return pickle.dumps(answer(service, fields, t_s))
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            return pickle.dumps(("failed", "ServiceBroken", f"{service} gives what cannot be sent: {error}"))


def _closed(service: str) -> tuple[Literal["failed"], str, str]:
    return "failed", "WorkerDied", f"{service} was stopped: the workers are closed"


class _Connection:
    """That of this process, as Ray has but one; it ends with the last who uses it, if it was made for the first."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._users = 0
        self._made_here = False

    def open(self, settings: RaySettings, count: int) -> Any:
        """Ray, connected."""
        if importlib.util.find_spec("ray") is None:
            told = "compute services on a Ray cluster need Ray, which is not installed"
            raise DependencyMissing(f"{told}: run `pip install 'concertmaster[ray]'`")
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # Ray would report its use to its makers
        import ray  # noqa: PLC0415 - it is optional, and takes half a second

        with self._lock:
            if not ray.is_initialized():
                _start(ray, settings, count)
                self._made_here = True
            self._users += 1
        return ray

    def close(self, ray: Any) -> None:
        with self._lock:
            self._users -= 1
            if self._made_here and self._users == 0:
                ray.shutdown()
                self._made_here = False


_connection = _Connection()


def _start(ray: Any, settings: RaySettings, count: int) -> None:
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR"}
    try:
        if settings.address == "local":
            ray.init(
                address="local",
                num_cpus=math.ceil(count * settings.cpus),
                object_store_memory=_STORE_MB * _MB,
                include_dashboard=False,
                # Workers on this machine find the packages that we find.
                runtime_env={"env_vars": {"PYTHONPATH": os.pathsep.join(sys.path)}},
                **quiet,
            )
        else:
            ray.init(address=settings.address, **quiet)
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        told = " ".join(str(error).split())[:200]
        raise NoCluster(f"ray.address {settings.address}: no Ray cluster can be reached or started: {told}") from error
