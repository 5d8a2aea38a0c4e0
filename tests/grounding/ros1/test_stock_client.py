"""Stock ROS 1, the system's Python with rospy and rosservice, drives the simulated fleet of another process."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.contracts.ros_master import RosMaster

pytestmark = pytest.mark.ros1

_TIMEOUT_S = 60.0
_PYTHON = "/usr/bin/python3"
_GENERATOR = "/usr/lib/genpy/gensrv_py.py"
_PACKAGES = ("std_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs")


@pytest.fixture(scope="module")
def stock(ros_master: RosMaster, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The environment of stock programs while the fleet is served, with classes made of the types that it wrote."""
    folder = tmp_path_factory.mktemp("stock")
    command = [sys.executable, "-m", "executive.cli", "simulate", "--port", "0"]
    command += ["--ros1", ros_master.uri, "--srv", str(folder / "src")]
    environment = {**ros_master.environment, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout is not None
            for line in server.stdout:
                if line.startswith("serving at "):
                    break
            _generate(folder / "src" / "concertmaster_msgs", folder / "lib" / "concertmaster_msgs" / "srv")
            yield {**ros_master.environment, "PYTHONPATH": str(folder / "lib")}
            server.send_signal(signal.SIGINT)
            _, errors = server.communicate(timeout=_TIMEOUT_S)
            assert server.returncode == 130
            *warnings, last = errors.splitlines()
            assert last == "concertmaster: interrupted"
            assert all("md5sums do not match" in warning for warning in warnings)  # rospy tells who was turned away
        finally:
            server.kill()


def _generate(package: Path, out: Path) -> None:
    out.mkdir(parents=True)
    (out.parent / "__init__.py").touch()
    include = [f"-I{name}:/usr/share/{name}/msg" for name in (*_PACKAGES, "actionlib_msgs")]
    files = [str(file) for file in sorted((package / "srv").glob("*.srv"))]
    generator = [_PYTHON, _GENERATOR, "-p", package.name, "-o", str(out), *include]
    _run([*generator, *files], dict(os.environ))
    _run([*generator, "--initpy"], dict(os.environ))


def _run(command: list[str], environment: dict[str, str]) -> str:
    environment = {name: value for name, value in environment.items() if name not in ("PYTHONHOME", "VIRTUAL_ENV")}
    done = subprocess.run(
        command,
        env=environment,
        capture_output=True,
        text=True,
        timeout=_TIMEOUT_S,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_rospy_drives_the_fleet(stock: dict[str, str]) -> None:
    """It reads a laser, moves a base, is told why a request is refused, and cannot mistake a type for another.

    Lasers and bases are there as topics too.
    """
    told = json.loads(_run([_PYTHON, str(Path(__file__).with_name("stock_client.py"))], stock))
    assert told["topic"] == 271
    assert told["driven"] > 0.0
    assert told["scan"] == ["amigo_1/laser", 271]
    assert told["odometry"] == told["after that"] == "amigo_1/base_link"
    assert "BadRequest: /amigo_1/base" in told["refused"]
    assert "md5sums do not match" in told["other type"]


def test_rosservice_knows_and_calls_the_services(stock: dict[str, str]) -> None:
    """By name and type, and prints the fields of a reply."""
    assert {"/amigo_1/laser", "/pico_1/kinect"} <= set(_run(["rosservice", "list"], stock).splitlines())
    assert _run(["rosservice", "type", "/amigo_1/laser"], stock) == "concertmaster_msgs/Laser\n"
    assert 'frame_id: "pico_1/laser"' in _run(["rosservice", "call", "/pico_1/laser"], stock)
