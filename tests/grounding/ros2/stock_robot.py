"""A robot as others write them with rclpy, run by the Python of ROS 2: services, topics and an action.

Prints "ready" once it is up; leaves ROS 2 in good order on SIGTERM.
"""

import os
import signal
import sys
import threading
from contextlib import suppress
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String
from std_srvs.srv import Empty, SetBool, Trigger
from test_msgs.action import Fibonacci
from test_msgs.srv import BasicTypes

rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node = rclpy.create_node("stock_robot")
group = ReentrantCallbackGroup()
said: list[str] = []


class Leaves(Exception):
    """Ends what is under way without an answer."""


def echo(request: Any, response: Any) -> Any:
    """After 25 ms, as a robot that computes."""
    stopped.wait(0.025)
    for name in request.get_fields_and_field_types():
        setattr(response, name, getattr(request, name))
    return response


def plan(request: Any, response: Any) -> Any:
    """The way from start to goal, straight."""
    response.plan.header = request.start.header
    response.plan.poses = [request.start, request.goal]
    return response


def slow(request: Any, response: Any) -> Any:
    """After half a second."""
    stopped.wait(0.5)
    response.success, response.message = True, "slow"
    return response


def hang(request: Any, response: Any) -> Any:
    """Never answer."""
    stopped.wait()
    raise Leaves


def trigger(request: Any, response: Any) -> Any:
    """Without success."""
    response.success, response.message = False, "the arm is folded"
    return response


def last(request: Any, response: Any) -> Any:
    """What it has heard, and whether a goal was canceled."""
    response.success, response.message = request.data, "|".join(said)
    return response


def crash(request: Any, response: Any) -> Any:
    """Die without a word."""
    os._exit(1)


def nothing(request: Any, response: Any) -> Any:
    """Do nothing."""
    return response


def fibonacci(handle: Any) -> Any:
    """Numbers, cut to fit, one every 20 ms; the goal of order 7 is aborted."""
    feedback, numbers = Fibonacci.Feedback(), [0, 1]
    for _ in range(handle.request.order):
        if handle.is_cancel_requested:
            said.append("canceled")
            handle.canceled()
            return Fibonacci.Result(sequence=numbers)
        numbers.append((numbers[-1] + numbers[-2]) % 1_000_000_007)
        feedback.sequence = numbers
        handle.publish_feedback(feedback)
        if stopped.wait(0.02):
            raise Leaves
    if handle.request.order == 7:
        handle.abort()
    else:
        handle.succeed()
    return Fibonacci.Result(sequence=numbers)


def take_goal(goal: Any) -> Any:
    """Reject what makes no sense."""
    return GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT


def scan() -> None:
    """Say what a laser sees."""
    message = LaserScan(angle_increment=0.5, ranges=[1.0, float("inf"), float("nan"), 0.1])
    message.header.frame_id = "stock/laser"
    message.header.stamp.sec, message.header.stamp.nanosec = 1_700_000_000, 250_000_000
    scans.publish(message)


stopped = threading.Event()
wait, leave = os.pipe()
for name, kind, function in (
    ("echo", BasicTypes, echo),
    ("plan", GetPlan, plan),
    ("slow", Trigger, slow),
    ("hang", Trigger, hang),
    ("trigger", Trigger, trigger),
    ("last", SetBool, last),
    ("crash", Trigger, crash),
    ("nothing", Empty, nothing),
):
    node.create_service(kind, f"/stock/{name}", function, callback_group=group)
fibonacci_server = ActionServer(
    node,
    Fibonacci,
    "/stock/fibonacci",
    fibonacci,
    goal_callback=take_goal,
    cancel_callback=lambda handle: CancelResponse.ACCEPT,
    callback_group=group,
)
scans = node.create_publisher(LaserScan, "/stock/scan", qos_profile_sensor_data)
node.create_timer(0.05, scan, callback_group=group)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
kept = node.create_publisher(String, "/stock/kept", latched)
kept.publish(String(data="said before you came"))
images = node.create_publisher(Image, "/stock/image_back", 2)
node.create_subscription(Image, "/stock/image", images.publish, 2, callback_group=group)
poses = node.create_publisher(PoseStamped, "/stock/pose_back", 2)
node.create_subscription(PoseStamped, "/stock/pose", poses.publish, 2, callback_group=group)
node.create_subscription(String, "/stock/kept_words", lambda message: said.append(message.data), latched)

executor = MultiThreadedExecutor(8)
executor.add_node(node)


def run() -> None:
    """Serve."""
    while not stopped.is_set():
        with suppress(Leaves):
            executor.spin_once(timeout_sec=0.1)


thread = threading.Thread(target=run)
thread.start()
sys.stdout.write("ready\n")
sys.stdout.flush()
signal.signal(signal.SIGTERM, lambda number, frame: os.close(leave))
os.read(wait, 1)
stopped.set()
thread.join()
executor.shutdown()
fibonacci_server.destroy()
node.destroy_node()
rclpy.try_shutdown()
