"""Processes of others do their work: OWL-S examples, imported, planned and carried out with services of this test."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from executive import Fleet
from executive.errors import BadRequest
from executive.events import Requested, TaskStatus
from executive.pace import SIMULATED
from executive.recorder import Recorder
from executive.request import check_request
from executive.results import TaskResult
from executive.shell import Shell
from grounding.errors import GroundingError
from grounding.inprocess import InProcessTransport, Service
from grounding.runner import compute_services
from kb.clock import SimClock
from kb.errors import ServiceFailed
from kb.files import SHIPPED
from kb.imports.owls import import_owls
from kb.store import KnowledgeBase, Snapshot
from kb.writing import Entity, Sort, ontology_text

BASE = "http://example.org/concertmaster"
OWLS = Path(__file__).parents[1] / "data" / "owls"
Handler = Callable[[Mapping[str, object]], Mapping[str, object]]


class Office:
    """A site without robots, whose tasks only ask services."""

    def __init__(self, knowledge: KnowledgeBase, services: Mapping[str, Handler]) -> None:
        self.clock = SimClock()
        self.recorder = Recorder(None)
        self._knowledge = knowledge
        transport = InProcessTransport(self.clock)
        durations = {g.service: g.duration_s for g in self.snapshot.groundings.values()}
        for name, offered in compute_services(self.clock, durations).items():
            transport.offer(name, offered)
        for name, handler in services.items():
            transport.offer(name, Service(handler=handler, latency_s=durations[name]))
        self._shell = Shell(knowledge, transport, self.clock, self.recorder, SIMULATED)

    @property
    def snapshot(self) -> Snapshot:
        return self._knowledge.snapshot()

    def do(self, process: str, **arguments: str) -> TaskResult:
        """File a task and wait for its end."""
        request = check_request(process, arguments, None, self.snapshot)
        self._shell.post(Requested(task="it", request=request))
        assert self.clock.run_until(lambda: "it" in self._shell.results)
        return self._shell.results["it"]


@contextmanager
def office(
    folder: Path,
    file: str,
    services: Mapping[str, Handler],
    things: Mapping[str, str] | None = None,
    password: str = "",
) -> Iterator[Office]:
    """An office that knows the processes of an OWL-S file, and things by their classes.

    Args:
        password: Of `account`.
    """
    iri, own = f"{BASE}/imported.owl", f"{BASE}/office.owl"
    (folder / "tasks").mkdir()
    (folder / "tasks" / "imported.owl").write_text(import_owls(OWLS / file, iri).text, encoding="utf-8")
    (folder / "sites" / "office").mkdir(parents=True)
    individuals = [
        Entity(
            iri=f"{own}#{name}",
            sort=Sort.INDIVIDUAL,
            types=(f"{iri}#{kind}",),
            links=((f"{iri}#hasPassword", f"{own}#{password}"),) if name == "account" else (),
        )
        for name, kind in (things or {}).items()
    ]
    text = ontology_text(own, individuals, imports=[iri, f"{BASE}/core.owl"])
    (folder / "sites" / "office" / "office.owl").write_text(text, encoding="utf-8")
    knowledge = KnowledgeBase("office", folder)
    try:
        yield Office(knowledge, services)
    finally:
        knowledge.close()


@pytest.mark.parametrize(
    ("bn_usd", "amazon_usd", "store", "price_usd"),
    [(12.5, 13.0, "Barnes & Nobles", 12.5), (13.0, 12.5, "Amazon", 12.5), (12.5, 12.5, "Amazon", 12.5)],
)
def test_the_cheaper_book_wins(bn_usd: float, amazon_usd: float, store: str, price_usd: float, tmp_path: Path) -> None:
    """FindCheaperBook finds the book, asks both stores at the same time, and tells the lower price and who has it."""
    asked: list[str] = []

    def price(name: str, usd: float) -> Handler:
        def answer(fields: Mapping[str, object]) -> Mapping[str, object]:
            [book] = fields.values()
            asked.append(f"{name} {json.loads(str(book))['isbn']}")
            return {"book_price": json.dumps({"amount": usd, "currency": "USD"})}

        return answer

    services: dict[str, Handler] = {
        "/books/DoKeywordSearch": lambda fields: {"book_info": json.dumps({"isbn": str(fields["keyword"]).upper()})},
        "/bnprice/GetBNQuote": price("bn", bn_usd),
        "/AWSECommerceService/ItemLookup": price("amazon", amazon_usd),
    }
    with office(tmp_path, "FindCheaperBook.owl", services) as shop:
        result = shop.do("FindCheaperBookProcess", bookName="Ulysses, by Joyce")
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert sorted(asked) == ["amazon ULYSSES, BY JOYCE", "bn ULYSSES, BY JOYCE"]
        assert result.outputs["bookstore"] == store
        assert json.loads(result.outputs["bookPrice"]) == {"amount": price_usd, "currency": "USD"}


THINGS = {
    "eindhoven": "Airport",
    "zurich": "Airport",
    "monday": "FlightDate",
    "friday": "FlightDate",
    "both_ways": "RoundTrip",
    "account": "AcctName",
    "sesame": "Password",
    "guess": "Password",
    "yes": "Confirmation",
}
TRIP = {
    "departureAirport": "eindhoven",
    "arrivalAirport": "zurich",
    "outboundDate": "monday",
    "inboundDate": "friday",
    "roundTrip": "both_ways",
    "acctName": "account",
    "password": "sesame",
    "confirm": "yes",
}
WSDL = "/BravoAirGrounding"


def airline(log: list[str], *, lets_in: bool = True) -> dict[str, Handler]:
    """The services of BravoAir: flights are texts, the reservation tells what was booked."""

    def flights(fields: Mapping[str, object]) -> Mapping[str, object]:
        log.append("flights")
        route = f"{fields['departure_airport']}-{fields['arrival_airport']}"
        return {"flights_found": json.dumps([f"{route} {fields['outbound_date']} {hour}:00" for hour in (8, 17)])}

    def select(fields: Mapping[str, object]) -> Mapping[str, object]:
        log.append("select")
        return {"available_flight_itinerary_list": json.loads(str(fields["preferred_flight_itinerary"]))[-1]}

    def log_in(fields: Mapping[str, object]) -> Mapping[str, object]:
        log.append(f"log in {fields['acct_name']} {fields['password']}")
        if not lets_in:
            raise ServiceFailed("WrongPassword", "this is not the password of the account")
        return {"result": True}

    def confirm(fields: Mapping[str, object]) -> Mapping[str, object]:
        log.append("confirm")
        booked = str(fields["reservation_id"])
        return {"preferred_flight_itinerary": booked, "reservation_id_out": f"B-{len(booked)}"}

    return {
        f"{WSDL}/GetDesiredFlightDetails_operation": flights,
        f"{WSDL}/SelectAvailableFlight_operation": select,
        f"{WSDL}/LogIn_operation": log_in,
        f"{WSDL}/ConfirmReservation_operation": confirm,
    }


def test_a_flight_is_booked(tmp_path: Path) -> None:
    """BravoAir finds flights, takes the last, logs in and confirms, as it is logged in then; values go all the way."""
    log: list[str] = []
    with office(tmp_path, "BravoAirProcess.owl", airline(log), THINGS, "sesame") as desk:
        result = desk.do("BravoAir_Process", **TRIP)
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert log == ["flights", "select", "log in account sesame", "confirm"]
        assert result.outputs["preferredFlightItinerary"] == "eindhoven-zurich monday 17:00"
        assert result.outputs["reservationID"] == "B-29"
        assert len(json.loads(result.outputs["flightsFound"])) == 2
        assert desk.snapshot.value("isLoggedIn", "account") is True


def test_a_wrong_password_is_known_before(tmp_path: Path) -> None:
    """The conditions under which LogIn succeeds are its preconditions: with another password, nothing is begun."""
    log: list[str] = []
    with office(tmp_path, "BravoAirProcess.owl", airline(log), THINGS, "guess") as desk:
        result = desk.do("BravoAir_Process", **TRIP)
        assert result.status is TaskStatus.REFUSED
        assert log == []


def test_a_service_that_fails_ends_the_task(tmp_path: Path) -> None:
    """Where the airline does not let the account in, the task fails and says why; nothing is confirmed."""
    log: list[str] = []
    with office(tmp_path, "BravoAirProcess.owl", airline(log, lets_in=False), THINGS, "sesame") as desk:
        result = desk.do("BravoAir_Process", **TRIP)
        assert result.status is TaskStatus.FAILED
        assert "this is not the password" in result.reason
        assert "confirm" not in log


def test_what_a_person_cannot_give(tmp_path: Path) -> None:
    """Texts are given as they are; a thing that the site does not have is refused, as is a text that is no text."""
    with office(tmp_path, "BravoAirProcess.owl", {}, THINGS, "sesame") as desk:
        with pytest.raises(BadRequest, match="atlantis"):
            check_request("BravoAir_Process", {**TRIP, "departureAirport": "atlantis"}, None, desk.snapshot)
        with pytest.raises(BadRequest, match="give a text"):
            check_request("SelectAvailableFlight", {"flightsAvailable": 7}, None, desk.snapshot)
        request = check_request("SelectAvailableFlight", {"flightsAvailable": "[]"}, None, desk.snapshot)
        assert request.arguments == {"flightsAvailable": "[]"}


def test_robots_beside_services(tmp_path: Path) -> None:
    """A fleet of robots is offered services of others when it is opened, and does imported processes with them."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "knowledge"))
    iri = f"{BASE}/imported.owl"
    (folder / "tasks" / "imported.owl").write_text(import_owls(OWLS / "BookFinder.owl", iri).text, encoding="utf-8")
    site = folder / "sites" / "tue_lab" / "tue_lab.owl"
    text, line = site.read_text(encoding="utf-8"), f'        <owl:imports rdf:resource="{BASE}/core.owl"/>\n'
    site.write_text(text.replace(line, f'{line}        <owl:imports rdf:resource="{iri}"/>\n'), encoding="utf-8")
    with pytest.raises(GroundingError, match="there is no /books/DoKeywordSearch"):
        Fleet.open("tue_lab", knowledge=folder)

    def found(fields: Mapping[str, object]) -> Mapping[str, object]:
        return {"book_info": f"about {fields['keyword']}"}

    with Fleet.open("tue_lab", knowledge=folder, services={"/books/DoKeywordSearch": found}) as fleet:
        result = fleet.request("BookFinderProcess", bookName="golog").wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert result.outputs["bookInfo"] == "about golog"
