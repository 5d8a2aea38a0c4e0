"""What a fleet's work costs: calls, bytes and time of each service for each robot ([RoboEarth] Table 3), and processor.

Beside that, how often a compute service was asked for what was known already.

They are no part of the trace: how long a computation really takes differs from run to run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from grounding.caching import CacheCount
from grounding.outcome import Outcome
from grounding.sizes import payload_bytes
from grounding.transport import ServiceCall
from kb.clock import Stopwatch


@dataclass(slots=True, kw_only=True)
class Use:
    """The calls of one service for one robot.

    Attributes:
        robot: For whom; empty if for none.
        failed: How many of them did not succeed.
        request_bytes: Of data, in all requests; `reply_bytes` in all replies.
        time_s: From call to reply, by the clock of the fleet, in all; `longest_s` of a single one.
    """

    service: str
    robot: str
    calls: int = 0
    failed: int = 0
    request_bytes: int = 0
    reply_bytes: int = 0
    time_s: float = 0.0
    longest_s: float = 0.0


@dataclass(slots=True)
class Metrics:
    """Counts while a fleet works; read it at any time.

    Attributes:
        known: Tells how often what was asked for was known, by service, of those whose replies are kept.
    """

    known: Callable[[], Mapping[str, CacheCount]] = dict
    stopwatch: Stopwatch = field(default_factory=Stopwatch)
    _uses: dict[tuple[str, str], Use] = field(default_factory=dict)
    _known: dict[tuple[str, str], tuple[object, int]] = field(default_factory=dict)

    def note(self, call: ServiceCall, robot: str, outcome: Outcome, reply: Mapping[str, object]) -> None:
        """Count a call that has ended.

        Args:
            robot: For whom it was; empty if for none.
            reply: The fields of the reply, if there was one.
        """
        use = self._uses.setdefault((call.service, robot), Use(service=call.service, robot=robot))
        use.calls += 1
        use.failed += not outcome.succeeded
        use.request_bytes += self._bytes(f"{call.service}?", call.fields)
        use.reply_bytes += self._bytes(call.service, reply)
        use.time_s += outcome.elapsed_s
        use.longest_s = max(use.longest_s, outcome.elapsed_s)

    def uses(self) -> list[Use]:
        """All services that were called, by name and robot."""
        return [use for _, use in sorted(self._uses.items())]

    def told(self) -> dict[str, Any]:
        """All of it, to be written as JSON."""
        return {
            "wall_s": self.stopwatch.wall_s,
            "cpu_s": self.stopwatch.cpu_s,
            "cpu_share": self.stopwatch.cpu_s / max(self.stopwatch.wall_s, 1e-9),
            "services": [asdict(use) for use in self.uses()],
            "caches": [
                {"service": service, **asdict(count), "hit_rate": count.hit_rate}
                for service, count in self.known().items()
            ],
        }

    def _bytes(self, of: str, fields: Mapping[str, object]) -> int:
        """As `payload_bytes`; a map that is handed on again and again is measured once."""
        total = 0
        for name, value in fields.items():
            known, size = self._known.get((of, name), (None, 0))
            if known is not value:
                size = payload_bytes(value)
                self._known[of, name] = (value, size)
            total += size
        return total
