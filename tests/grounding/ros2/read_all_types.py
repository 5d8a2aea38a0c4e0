"""Reads the default of every installed message, run by the Python of ROS 2; prints the types that are not read."""

import sys
from importlib import import_module

from rclpy.serialization import serialize_message

sys.path += sys.argv[1:]

from grounding.ros2.interfaces import InstalledTypes
from kb.errors import ConcertmasterError

_PACKAGES = (
    "action_msgs builtin_interfaces geometry_msgs lifecycle_msgs nav_msgs rcl_interfaces sensor_msgs std_msgs test_msgs"
)
types, read = InstalledTypes(), 0
for package in _PACKAGES.split():
    module = import_module(f"{package}.msg")
    for name in sorted(vars(module)):
        if hasattr(getattr(module, name), "get_fields_and_field_types"):
            try:
                full = types.message(f"{package}/{name}")
                types.read(full, serialize_message(types.class_of(full)()))
            except ConcertmasterError as error:
                sys.stdout.write(f"{error}\n")
            else:
                read += 1
sys.stdout.write(f"{read} read\n")
