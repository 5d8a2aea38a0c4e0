"""A client of ROS 1 as anyone writes it: rospy, and classes that genpy makes. Run by the system's Python."""

import json
import math
import sys

import rospy
from concertmaster_msgs.srv import Base, Laser
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan


def _error(service: rospy.ServiceProxy, request: Twist) -> str:
    try:
        service(request)
    except rospy.ServiceException as error:
        return str(error)
    return ""


def _driven() -> float:
    """How fast a robot is that hears velocities until it moves."""
    speaker, odometry = rospy.Publisher("/pico_1/cmd_vel", Twist, queue_size=1), Odometry()
    while not odometry.twist.twist.linear.x > 0.0:
        speaker.publish(velocity)
        odometry = rospy.wait_for_message("/pico_1/odom", Odometry, timeout=20.0)
    return float(odometry.twist.twist.linear.x)


rospy.init_node("stock_client")
for name in ("/amigo_1/laser", "/amigo_1/base"):
    rospy.wait_for_service(name, timeout=20.0)
scan = rospy.ServiceProxy("/amigo_1/laser", Laser)().scan
base = rospy.ServiceProxy("/amigo_1/base", Base, persistent=True)
velocity, wrong = Twist(), Twist()
velocity.linear.x, wrong.linear.x = 0.2, math.nan
told = {
    "topic": len(rospy.wait_for_message("/amigo_1/scan", LaserScan, timeout=20.0).ranges),
    "driven": _driven(),
    "scan": [scan.header.frame_id, len(scan.ranges)],
    "odometry": base(velocity).odometry.child_frame_id,
    "refused": _error(base, wrong),
    "after that": base(velocity).odometry.child_frame_id,
    "other type": _error(rospy.ServiceProxy("/amigo_1/laser", Base), velocity),
}
json.dump(told, sys.stdout)
