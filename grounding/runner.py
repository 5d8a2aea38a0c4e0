"""Runs the compute services ([RoboEarth] Table 2): here, or where the configuration of a site says."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any, Literal, Protocol, TypeAlias

from grounding.compute.registry import function_of, is_compute_service, wrong_fields
from grounding.inprocess import Service
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Clock, WallClock
from kb.errors import ServiceFailed

Fields: TypeAlias = Mapping[str, object]

Answer: TypeAlias = tuple[Literal["done"], Fields] | tuple[Literal["failed"], str, str]
"""What comes of a call: fields, or the class and the sentence of its failure. It can be sent between processes."""


class Runner(Protocol):
    """Where compute services run."""

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        """Run a service as of time `t_s`; at once, or while the caller goes on.

        Returns:
            Ends with the reply's fields, or with ServiceFailed: what the service says of itself, `ServiceBroken` if
            it raises anything else, and in processes of their own `TookTooLong` after `timeout_s`, `WorkerDied`, or
            `Busy`.
        """

    def close(self) -> None:
        """End what still runs."""


class Here:
    """Runs services in this process, one after the other; none of them is stopped before its end."""

    def submit(self, service: str, fields: Fields, *, t_s: float, timeout_s: float) -> Future[Fields]:
        ended = Future[Fields]()
        settle(ended, answer(service, fields, t_s))
        return ended

    def close(self) -> None:
        """Nothing runs between two calls."""


def compute(service: str, fields: Fields, *, t_s: float) -> Fields:
    """Run a compute service now.

    Raises:
        ServiceFailed: It cannot do what it is asked, does not exist, or does not take these fields.
    """
    function = function_of(service)
    arguments: dict[str, Any] = {
        name: Path(str(value)) if name.endswith("_file") else value for name, value in fields.items()
    }
    wrong = wrong_fields(service, set(arguments))
    if wrong:
        raise ServiceFailed("BadInput", wrong)
    return function(**arguments, t_s=t_s)


def answer(service: str, fields: Fields, t_s: float) -> Answer:
    """Run a compute service now, whatever it does."""
    try:
        return "done", compute(service, fields, t_s=t_s)
    except ServiceFailed as failed:
        return "failed", failed.code, failed.message
    except MemoryError:
        return "failed", "OutOfMemory", f"{service} needs more memory than there is for it"
    except Exception as error:  # noqa: BLE001 - it may be anybody's code; what it does wrong is its failure, not ours
        return "failed", "ServiceBroken", f"{service} raised {type(error).__name__}: {error}"


def settle(ended: Future[Fields], came: Answer) -> None:
    """End a call with what has come of it."""
    match came:
        case ("done", reply):
            ended.set_result(reply)
        case ("failed", code, message):
            ended.set_exception(ServiceFailed(code, message))


def compute_services(clock: Clock, duration_s: Mapping[str, float], runner: Runner | None = None) -> dict[str, Service]:
    """The compute services for a transport under simulated time, which stands still while they run.

    Args:
        duration_s: How long each is said to take, by name of the service: the time that passes until its reply.
        runner: Where they run; here if left out.
    """
    where = runner or Here()

    def service(name: str, seconds: float) -> Service:
        def handle(fields: Fields) -> Fields:
            return where.submit(name, fields, t_s=clock.now_s, timeout_s=_PATIENCE_S).result()

        return Service(handler=handle, latency_s=seconds)

    return {name: service(name, seconds) for name, seconds in duration_s.items() if is_compute_service(name)}


_PATIENCE_S = 600.0
"""Real time says nothing about simulated time; only a service that hangs for good is to be stopped."""


class ComputeTransport:
    """Calls to compute services in real time: a reply comes when the service has ended, wherever it runs."""

    def __init__(self, clock: WallClock, runner: Runner) -> None:
        self._clock, self._runner = clock, runner

    def call(self, call: ServiceCall, deliver: Callable[[ServiceReply], None]) -> None:
        if not is_compute_service(call.service):
            told = f"there is no service {call.service}"
            reply = ServiceReply(call_id=call.id, fields={}, failure="NoSuchService", reason=told)
            self._clock.post(lambda: deliver(reply))
            return
        stop_listening = self._clock.listen()

        def end(ended: Future[Fields]) -> None:
            stop_listening()
            error = ended.exception()
            if isinstance(error, ServiceFailed):
                deliver(ServiceReply(call_id=call.id, fields={}, failure=error.code, reason=error.message))
            else:
                deliver(ServiceReply(call_id=call.id, fields=ended.result(), failure="", reason=""))

        submitted = self._runner.submit(call.service, call.fields, t_s=self._clock.now_s, timeout_s=call.timeout_s)
        submitted.add_done_callback(lambda ended: self._clock.post(lambda: end(ended)))

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        offered: dict[int, bool | None] = {call.id: is_compute_service(call.service) for call in calls}
        self._clock.post(lambda: told(offered))
