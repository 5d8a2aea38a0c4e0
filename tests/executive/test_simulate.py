"""The simulated fleet of a site, behind a rosbridge server in another process."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest

from executive.cli import main
from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.messages import Image, LaserScan, Odometry, Twist, Vector3, pose_stamped
from grounding.rosbridge.client import RosbridgeTransport, service_types
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import WallClock
from kb.files import SHIPPED
from kb.store import KnowledgeBase
from tests.grounding.rosbridge.certificates import self_signed

_TIMEOUT_S = 60.0


def test_a_client_with_the_same_knowledge_drives_the_fleet_until_it_is_interrupted() -> None:
    """Its laser answers as grounded, its navigation takes goals; Ctrl-C ends the server as it ends every command."""
    with _simulated() as (server, services, uri):
        assert {"/amigo_1/laser", "/pico_1/base", "/amigo_1/navigate_to_pose"} <= set(services)
        assert services == sorted(services)
        assert isinstance(_reply(Endpoint(uri=uri)).fields["scan"], LaserScan)
        fed, driven, canceled = _drive(uri)
        assert fed > 5
        assert (driven.status, driven.fields["error_code"]) == (GoalStatus.SUCCEEDED, 0)
        assert canceled.status is GoalStatus.CANCELED
        server.send_signal(signal.SIGINT)
        rest, errors = server.communicate(timeout=_TIMEOUT_S)
        assert (server.returncode, rest, errors) == (130, "", "concertmaster: interrupted\n")


def test_who_has_no_token_gets_no_scan(tmp_path: Path) -> None:
    """With a file that says who may do what, over TLS: who is told to calls, who is not is told so."""
    certificate_file, key_file = self_signed(tmp_path)
    access = tmp_path / "access.toml"
    access.write_text(
        f'[roles.executive]\ntoken_variable = "TOKEN"\ncall = ["*"]\n'
        f'[tls]\ncertificate_file = "{certificate_file.name}"\nkey_file = "{key_file.name}"\n'
    )
    with _simulated("--access", str(access), variables={"TOKEN": "hush"}) as (_, _, uri):
        assert uri.startswith("wss://")
        refused = _reply(Endpoint(uri=uri, ca_file=certificate_file))
        assert (refused.failure, "say first who you are" in refused.reason) == ("NotAllowed", True)
        allowed = _reply(Endpoint(uri=uri, ca_file=certificate_file, token="hush"))
        assert isinstance(allowed.fields["scan"], LaserScan)


@contextmanager
def _simulated(
    *options: str, variables: Mapping[str, str] | None = None
) -> Iterator[tuple[subprocess.Popen[str], list[str], str]]:
    """A server with these options: its process, the services that it tells of, and its address."""
    command = [sys.executable, "-m", "executive.cli", "simulate", "--port", "0", *options]
    environment = os.environ | (variables or {})
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as server:
        try:
            assert server.stdout is not None
            lines = []
            for line in server.stdout:
                lines.append(line.rstrip("\n"))
                if line.startswith("serving at "):
                    break
            *services, told = lines
            yield server, services, told.split()[2]
        finally:
            server.kill()


def _reply(endpoint: Endpoint) -> ServiceReply:
    """What the laser of amigo_1 says."""
    types, clock = Types(), WallClock()
    with closing(KnowledgeBase("tue_lab", SHIPPED)) as base:
        services = service_types(base.snapshot().groundings.values(), ["amigo_1"], types)
    rng = np.random.default_rng(0)
    with RosbridgeTransport(endpoint, clock, services=services, types=types, binary=True, rng=rng) as robots:
        assert robots.wait_connected(_TIMEOUT_S), robots.problem
        replies: list[ServiceReply] = []
        robots.call(ServiceCall(id=1, service="/amigo_1/laser", fields={}, timeout_s=_TIMEOUT_S), replies.append)
        clock.run_until(lambda: bool(replies))
        return replies[0]


def test_who_watches_sees_scans_pictures_and_how_far_a_robot_has_driven() -> None:
    """On topics, as often as is said; it drives by velocities, and stands when they end."""
    types, clock, rng = Types(), WallClock(), np.random.default_rng(0)
    with (
        _simulated() as (_, names, uri),
        RosbridgeTransport(Endpoint(uri=uri), clock, services={}, types=types, rng=rng) as robots,
    ):
        assert robots.wait_connected(_TIMEOUT_S), robots.problem
        assert {"/pico_1/scan", "/amigo_1/odom", "/amigo_1/cmd_vel"} <= set(names)
        scans: list[object] = []
        scan = robots.subscribe("/pico_1/scan", "sensor_msgs/LaserScan", scans.append)
        odometry = robots.subscribe("/amigo_1/odom", "nav_msgs/Odometry")
        pictures = [
            robots.subscribe(f"/pico_1/camera/{kind}/image_raw", "sensor_msgs/Image") for kind in ("color", "depth")
        ]
        clock.run_until(lambda: len(scans) >= 5 and odometry.newest is not None and all(p.newest for p in pictures))
        assert isinstance(scan.newest, LaserScan)
        assert [p.newest.encoding for p in pictures if isinstance(p.newest, Image)] == ["rgb8", "32FC1"]
        robots.advertise("/amigo_1/cmd_vel", "geometry_msgs/Twist")
        zero = Vector3(x=0.0, y=0.0, z=0.0)
        driven_m = 0.0

        def drive() -> None:
            robots.publish("/amigo_1/cmd_vel", Twist(linear=Vector3(x=0.3, y=0.0, z=0.0), angular=zero))
            if driven_m < 0.2:
                clock.call_at(clock.now_s + 0.1, drive)

        def far() -> bool:
            nonlocal driven_m
            assert isinstance(odometry.newest, Odometry)
            at = odometry.newest.pose.pose.position
            driven_m = math.hypot(at.x, at.y)
            return driven_m >= 0.2

        drive()
        clock.run_until(far)
        clock.run_until(lambda: isinstance(odometry.newest, Odometry) and odometry.newest.twist.twist.linear.x == 0.0)
        assert driven_m < 0.6


def _drive(uri: str) -> tuple[int, GoalResult, GoalResult]:
    """Give a robot a goal, and another one that is canceled on the way."""
    types, clock = Types(), WallClock()
    action, rng = "/amigo_1/navigate_to_pose", np.random.default_rng(0)
    known = {action: types.action("nav2_msgs/NavigateToPose")}
    results: list[GoalResult] = []
    fed: list[Mapping[str, object]] = []
    with RosbridgeTransport(Endpoint(uri=uri), clock, services={}, actions=known, types=types, rng=rng) as robots:
        assert robots.wait_connected(_TIMEOUT_S), robots.problem

        def send(number: int, x_m: float) -> None:
            fields = {"pose": pose_stamped(x_m, 1.5, 0.0, t_s=0.0)}
            robots.send_goal(Goal(id=number, action=action, fields=fields), fed.append, results.append)

        send(1, 1.6)
        clock.run_until(lambda: bool(results))
        before = len(fed)
        send(2, 4.0)
        clock.run_until(lambda: len(fed) > before + 5)
        robots.cancel_goal(2)
        clock.run_until(lambda: len(results) == 2)
        return before, results[0], results[1]


def test_an_address_that_is_taken_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """It is said which, and what to do."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["simulate", "--port", str(port)]) == 2
    error = capsys.readouterr().err
    assert f"127.0.0.1:{port} cannot be listened at" in error
    assert error.endswith("give another --port\n")


def test_a_port_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """Before anything is loaded."""
    assert main(["simulate", "--port", "70000"]) == 2
    assert "port 70000 is none" in capsys.readouterr().err


def test_an_address_that_is_no_masters_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """Whether ROS 1 is installed or not."""
    assert main(["simulate", "--port", "0", "--ros1", "amigo-1"]) == 2
    assert "'amigo-1' is no address of a master; one is http://amigo-1:11311" in capsys.readouterr().err
