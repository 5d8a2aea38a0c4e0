"""Results of compute services that are kept: an equal request gets an earlier reply, as if it had been computed now."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Set
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock

from grounding.compute.registry import code_of, files_read
from grounding.compute.settings import CacheSettings
from grounding.kept import InMemory, Kept, OnDisk
from grounding.runner import Fields, Runner
from grounding.timeless import Unreadable, from_bytes, to_bytes
from kb.errors import ConcertmasterError

_MB = 1 << 20


class NoCacheFolder(ConcertmasterError):
    """The folder for results cannot be made or read."""

    fault = "world"


@dataclass(frozen=True, slots=True, kw_only=True)
class CacheCount:
    """How often a service was asked for what was known already.

    Attributes:
        hits: Calls that got an earlier reply, or that of an equal call which was just running.
        misses: Calls that were computed.
    """

    hits: int = 0
    misses: int = 0

    @property
    def hit_rate(self) -> float:
        """The share of calls that were hits; 0 where there was none."""
        return self.hits / max(1, self.hits + self.misses)


class Caching:
    """Runs services with another runner, but those that may be cached only where their reply is not known.

    Two requests are equal if all their fields are, but for stamps that say "now", and if the files that they name and
    the code of the service have the same content. What fails is not kept: it may go well the next time.
    """

    def __init__(self, runner: Runner, settings: CacheSettings, folder: Path) -> None:
        """Keep in memory what `may_keep` allows, and on disk what the settings name.

        Args:
            folder: Where results are kept for later runs, if the settings name none.

        Raises:
            NoCacheFolder: That is to be done, and is not possible.
        """
        self._runner = runner
        self._on_disk = frozenset(settings.on_disk)
        self._in_memory = frozenset[str]()
        self._memory = InMemory(settings.memory_mb * _MB)
        self._disk: OnDisk | None = None
        if self._on_disk:
            chosen = settings.folder or folder
            try:
                self._disk = OnDisk(chosen, settings.disk_mb * _MB)
            except OSError as error:
                raise NoCacheFolder(f"cache.folder {chosen} cannot be used: {error.strerror}") from error
        self._lock = Lock()  # calls end on threads of the runner
        self._running = dict[str, Future[bytes | None]]()
        self._code = dict[str, str]()
        self._counts = dict[str, CacheCount]()

    def may_keep(self, services: Set[str]) -> None:
        """From now on, replies of these services are kept in memory, and those of no others."""
        self._in_memory = frozenset(services)

    def counts(self) -> Mapping[str, CacheCount]:
        """Hits and misses by service, of those that have been asked."""
        with self._lock:
            return dict(sorted(self._counts.items()))

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        keepers = self._keepers(service)
        key = self._key(service, fields, t_s) if keepers else None
        if key is None:
            return self._runner.submit(service, fields, t_s=t_s, timeout_s=timeout_s)
        ended = Future[Fields]()
        with self._lock:
            known = _known(key, keepers, t_s)
            running = self._running.get(key)
            count = self._counts.get(service, CacheCount())
            if known is None and running is None:
                self._running[key] = shared = Future[bytes | None]()
                self._counts[service] = replace(count, misses=count.misses + 1)
            else:
                self._counts[service] = replace(count, hits=count.hits + 1)
        if known is not None:
            ended.set_result(known)
        elif running is not None:

            def join(done: Future[bytes | None]) -> None:
                if error := done.exception():
                    ended.set_exception(error)
                elif (data := done.result()) is not None:
                    ended.set_result(from_bytes(data, t_s))
                else:
                    own = self._runner.submit(service, fields, t_s=t_s, timeout_s=timeout_s)
                    own.add_done_callback(lambda computed: _pass_on(computed, ended))

            running.add_done_callback(join)
        else:

            def end(computed: Future[Fields]) -> None:
                self._end(key, keepers, shared, computed, t_s)
                _pass_on(computed, ended)

            self._runner.submit(service, fields, t_s=t_s, timeout_s=timeout_s).add_done_callback(end)
        return ended

    def close(self) -> None:
        """End what still runs; what is on disk stays."""
        self._runner.close()

    def _keepers(self, service: str) -> list[Kept]:
        """Where replies of a service are kept, the quickest first."""
        on_disk: list[Kept] = [self._disk] if self._disk and service in self._on_disk else []
        return [self._memory, *on_disk] if on_disk or service in self._in_memory else []

    def _key(self, service: str, fields: Fields, t_s: float) -> str | None:
        """What all equal requests have in common; None for one that cannot be compared."""
        try:
            if service not in self._code:
                self._code[service] = code_of(service)
            files = {
                name: [hashlib.sha256(file.read_bytes()).digest() for file in files_read(service, Path(str(value)))]
                for name, value in sorted(fields.items())
                if name.endswith("_file")
            }
            asked = {
                "service": service,
                "code": self._code[service],
                "files": files,
                "fields": dict(sorted(fields.items())),
            }
            return hashlib.sha256(to_bytes(asked, t_s)).hexdigest()
        except (ConcertmasterError, OSError, TypeError):
            return None  # the service will tell what is wrong, if that is wrong

    def _end(
        self, key: str, keepers: list[Kept], shared: Future[bytes | None], computed: Future[Fields], t_s: float
    ) -> None:
        """Keep what was computed, and give it to those who wait for the same."""
        error = computed.exception()
        data = None
        if error is None:
            with suppress(TypeError, ValueError):  # no message: it can be given to who asked, and cannot be kept
                data = to_bytes(computed.result(), t_s)
        with self._lock:
            del self._running[key]
            if data is not None:
                for keeper in keepers:
                    keeper.put(key, data)
        if error is not None:
            shared.set_exception(error)
        else:
            shared.set_result(data)


def _known(key: str, keepers: list[Kept], t_s: float) -> Fields | None:
    """An earlier reply, as of now; what is damaged is dropped."""
    for number, keeper in enumerate(keepers):
        if (data := keeper.get(key)) is None:
            continue
        try:
            reply = from_bytes(data, t_s)
        except Unreadable:
            keeper.drop(key)
            continue
        for quicker in keepers[:number]:
            quicker.put(key, data)
        return reply
    return None


def _pass_on(computed: Future[Fields], ended: Future[Fields]) -> None:
    if error := computed.exception():
        ended.set_exception(error)
    else:
        ended.set_result(computed.result())
