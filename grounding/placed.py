"""The runner of a site: each service where the settings say, kept results, and no files of others."""

from __future__ import annotations

from collections.abc import Mapping, Set
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path

from grounding.caching import CacheCount, Caching
from grounding.compute.settings import ComputeSettings
from grounding.on_ray import OnRay
from grounding.runner import Fields, Here, settle
from grounding.workers import Workers


class Placed:
    """Services run where the settings of a site say: here, in workers, or on a Ray cluster.

    Workers here start with the first call to them, the connection to a cluster at once. Wherever services run, they
    read files of folders that are allowed, and no others, and are not run for what is known.
    """

    def __init__(self, settings: ComputeSettings, cache_folder: Path) -> None:
        """Connect to the cluster if a service is to run there.

        Args:
            cache_folder: Where results are kept for later runs, if the settings ask for that and name no folder.

        Raises:
            DependencyMissing: A service is to run on Ray, which is not installed.
            NoCluster: A service is to run on a cluster that is not there.
            NoCacheFolder: Results cannot be kept where they are to be.
        """
        self._folders = set[Path]()
        self._places = _Places(settings)
        with ExitStack() as on_error:
            on_error.callback(self._places.close)
            self._caching = Caching(self._places, settings.cache, cache_folder)
            on_error.pop_all()

    def allow(self, folder: Path) -> None:
        """From now on, files in this folder may be read too."""
        self._folders.add(folder.resolve())

    def may_keep(self, services: Set[str]) -> None:
        """From now on, replies of these services are kept in memory, and those of no others."""
        self._caching.may_keep(services)

    def cache_counts(self) -> Mapping[str, CacheCount]:
        """How often what was asked for was known, by service."""
        return self._caching.counts()

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        for name, value in fields.items():
            if name.endswith("_file") and not self._may_read(Path(str(value))):
                folders = ", ".join(str(folder) for folder in sorted(self._folders)) or "no folder"
                told = f"{service}: {name} {value} is not in {folders}, where files of this site are"
                refused = Future[Fields]()
                settle(refused, ("failed", "BadInput", told))
                return refused
        return self._caching.submit(service, fields, t_s=t_s, timeout_s=timeout_s)

    def close(self) -> None:
        """End the workers."""
        self._caching.close()

    def _may_read(self, file: Path) -> bool:
        return any(file.resolve().is_relative_to(folder) for folder in self._folders)


class _Places:
    """Here, the workers, and the cluster."""

    def __init__(self, settings: ComputeSettings) -> None:
        self._settings = settings
        self._here = Here()
        self._workers: Workers | None = None
        self._ray = OnRay(settings.ray, settings.workers) if "ray" in settings.places.values() else None

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        match self._settings.places.get(service, "here"):
            case "workers":
                if self._workers is None:
                    self._workers = Workers(self._settings.workers)
                return self._workers.submit(service, fields, t_s=t_s, timeout_s=timeout_s)
            case "ray":
                assert self._ray is not None, "there is a service on Ray, so there is Ray"
                return self._ray.submit(service, fields, t_s=t_s, timeout_s=timeout_s)
            case _:
                return self._here.submit(service, fields, t_s=t_s, timeout_s=timeout_s)

    def close(self) -> None:
        if self._workers is not None:
            self._workers.close()
        if self._ray is not None:
            self._ray.close()
