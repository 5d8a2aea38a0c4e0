"""npm's roslib, unmodified, drives the simulated fleet; needs node, and the first time npm's registry."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.grounding.rosbridge.fleet import fleet_server

_SOURCE = Path(__file__).with_name("node")


def _installed() -> Path:
    """A folder outside of the tree with the driver and what its lock file names, kept from run to run."""
    lock = (_SOURCE / "package-lock.json").read_bytes()
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "concertmaster-tests"
    folder = cache / f"roslib-{hashlib.sha256(lock).hexdigest()[:16]}"
    if not (folder / "node_modules" / ".package-lock.json").exists():
        npm = shutil.which("npm")
        assert npm is not None, "npm is missing: install Node.js 18 or later with npm, or leave out -m node"
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(_SOURCE / name, folder / name)
        command = [npm, "ci", "--no-audit", "--no-fund"]
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
        assert run.returncode == 0, run.stderr
    shutil.copy(_SOURCE / "drive.mjs", folder / "drive.mjs")
    return folder


@pytest.mark.node
def test_roslib_drives_the_fleet() -> None:
    """Topics in each compression, services, a service of the client's own, actions, rosapi and parameters."""
    node = shutil.which("node")
    assert node is not None, "node is missing: install Node.js 18 or later, or leave out -m node"
    folder = _installed()
    with fleet_server() as (server, _):
        command = [node, "drive.mjs", server.uri]
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=90, check=False)
        assert run.returncode == 0, run.stderr
    saw = json.loads(run.stdout)
    assert saw["rosapi"] == {
        "rosout": True,
        "scanType": "sensor_msgs/LaserScan",
        "lasers": ["/amigo_1/laser", "/pico_1/laser"],
        "actions": ["/amigo_1/navigate_to_pose", "/fibonacci", "/pico_1/navigate_to_pose"],
        "decoded": {
            "position": dict.fromkeys("xyz", "float64"),
            "orientation": dict.fromkeys("xyzw", "float64"),
        },
    }
    assert saw["services"]["ranges"] > 100
    assert saw["services"]["frame"] == "amigo_1/odom"
    assert "NoSuchService: there is no service /none" in saw["services"]["problem"]
    assert saw["provided"] == {"success": True, "message": "done"}
    ranges = saw["services"]["ranges"]
    assert saw["topics"] == {
        "none": [ranges, "Array"],
        "png": [ranges, "Array"],
        "cbor": [ranges, "Float32Array"],
        "said": "Grüße",
    }
    assert saw["actions"]["done"] == {"sequence": [0, 1, 1, 2, 3]}
    assert saw["actions"]["fed"] == 3
    assert "canceled" in saw["actions"]["canceled"]
    assert "BadOrder: order is -1, should be 0 or more" in saw["actions"]["refused"]
    assert saw["navigation"]["done"] == {"error_code": 0, "error_msg": ""}
    assert saw["navigation"]["remaining"] < 0.1
    assert "canceled" in saw["navigation"]["canceled"]
    assert saw["params"] == [{"mps": 0.5}, False]
