"""PyPI's roslibpy, unmodified, drives the simulated fleet."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from executive.simulated_topics import SCAN_S
from tests.grounding.rosbridge.fleet import fleet_server

_DRIVER = Path(__file__).with_name("drive_roslibpy.py")


@pytest.mark.parametrize("transport", ["twisted", "asyncio"])
def test_roslibpy_drives_the_fleet(transport: str) -> None:
    """Topics, services, a service of the client's own, actions, rosapi, parameters, and thirty clients at once."""
    with fleet_server() as (server, fleet):
        start_x = fleet.true_pose("amigo_1")[0]
        command = [sys.executable, str(_DRIVER), str(server.port), transport]
        run = subprocess.run(command, capture_output=True, text=True, timeout=90, check=False)
        assert run.returncode == 0, run.stderr
        moved_m = abs(fleet.true_pose("amigo_1")[0] - start_x)
    saw = json.loads(run.stdout)
    assert saw["rosapi"] == {
        "rosout": True,
        "scan_type": "sensor_msgs/LaserScan",
        "lasers": ["/amigo_1/laser", "/pico_1/laser"],
        "request": ["data"],
        "message": ["geometry_msgs/Vector3", "geometry_msgs/Vector3"],
        "nodes": True,
        "time": ["nanosec", "sec"],
    }
    assert saw["service"]["ranges"] > 100
    assert saw["service"]["frame"] == "amigo_1/odom"
    assert "NoSuchService: there is no service /none" in saw["service"]["problem"]
    assert saw["provided"] is True
    assert saw["topic"]["said"] == "hello"
    assert saw["topic"]["apart_s"] == pytest.approx(SCAN_S, abs=0.005)
    assert saw["action"] == {
        "done": [4, [0, 1, 1, 2, 3]],
        "feedback": 3,
        "canceled": 5,
        "failed": "BadOrder: order is -1, should be 0 or more",
    }
    drove = saw["navigation"]
    assert (drove["done"], drove["canceled"], drove["failed"]) == ([4, 0], 5, [6, 208])
    assert drove["x_m"] == pytest.approx(1.6, abs=0.1)
    assert drove["remaining_m"][0] > 0.4 > 0.1 > drove["remaining_m"][1]
    assert saw["param"] == [0.5, False]
    assert saw["connected"] == 30
    assert moved_m > 0.05
