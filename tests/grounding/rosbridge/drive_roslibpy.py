"""Drives a server with roslibpy as it comes from PyPI; prints what it saw as one JSON object.

    python drive_roslibpy.py PORT twisted|asyncio

A process of its own, as roslibpy's event loop cannot be ended and begun again.
"""

from __future__ import annotations

import json
import queue
import sys
import threading
from typing import Any

import roslibpy
import roslibpy.core

WAIT_S = 20.0
_NOTHING = roslibpy.ServiceRequest()


def main(port: int, transport: str) -> dict[str, Any]:
    """All that can be asked of the server, one after the other."""
    ros = roslibpy.Ros("127.0.0.1", port, transport=transport)
    ros.run(timeout=WAIT_S)
    saw = {
        "rosapi": rosapi(ros),
        "service": services(ros),
        "provided": provided(ros),
        "topic": topic(ros),
        "action": actions(ros),
        "navigation": navigation(ros),
        "param": param(ros),
        "connected": parallel(port, transport),
    }
    ros.close()
    return saw


def rosapi(ros: Any) -> dict[str, Any]:
    """What there is."""
    return {
        "rosout": "/rosout" in ros.get_topics(),
        "scan_type": ros.get_topic_type("/amigo_1/scan"),
        "lasers": sorted(ros.get_services_for_type(ros.get_service_type("/amigo_1/laser"))),
        "request": ros.get_service_request_details("std_srvs/SetBool")["typedefs"][0]["fieldnames"],
        "message": ros.get_message_details("geometry_msgs/Twist")["typedefs"][0]["fieldtypes"],
        "nodes": "/concertmaster" in ros.get_nodes(),
        # `ros.get_time()` itself knows the field names of ROS 1 only
        "time": sorted(roslibpy.Service(ros, "/rosapi/get_time", "rosapi/GetTime").call(_NOTHING)["time"]),
    }


def services(ros: Any) -> dict[str, Any]:
    """Driving a robot, and a service that there is not."""
    laser = roslibpy.Service(ros, "/amigo_1/laser", "concertmaster_msgs/Laser").call(roslibpy.ServiceRequest())
    base = roslibpy.Service(ros, "/amigo_1/base", "concertmaster_msgs/Base")
    odometry = base.call(roslibpy.ServiceRequest({"velocity": {"linear": {"x": 0.2}}}))
    try:
        roslibpy.Service(ros, "/none", "std_srvs/Empty").call(roslibpy.ServiceRequest())
        problem = ""
    except roslibpy.core.ServiceException as error:
        problem = str(error)
    frame = odometry["odometry"]["header"]["frame_id"]
    return {"ranges": len(laser["scan"]["ranges"]), "frame": frame, "problem": problem}


def provided(ros: Any) -> bool:
    """A service of its own, called through the server."""

    def switch(request: Any, response: Any) -> bool:
        response["success"] = request["data"]
        return True

    lamp = roslibpy.Service(ros, "/lamp", "std_srvs/SetBool")
    lamp.advertise(switch)
    answers: queue.Queue[Any] = queue.Queue()
    caller = roslibpy.Service(ros, "/lamp", "std_srvs/SetBool")
    caller.call(roslibpy.ServiceRequest({"data": True}), callback=answers.put, errback=answers.put)
    answer = answers.get(timeout=WAIT_S)
    lamp.unadvertise()
    return bool(answer["success"])


def topic(ros: Any) -> dict[str, Any]:
    """Messages of the fleet and its own."""
    scans: queue.Queue[Any] = queue.Queue()
    scan = roslibpy.Topic(ros, "/amigo_1/scan", "sensor_msgs/LaserScan")
    scan.subscribe(scans.put)
    stamps = [scans.get(timeout=WAIT_S)["header"]["stamp"] for _ in range(2)]
    scan.unsubscribe()
    heard: queue.Queue[Any] = queue.Queue()
    listener = roslibpy.Topic(ros, "/chatter", "std_msgs/String")
    listener.subscribe(heard.put)
    talker = roslibpy.Topic(ros, "/chatter", "std_msgs/String")
    talker.publish(roslibpy.Message({"data": "hello"}))
    said = heard.get(timeout=WAIT_S)["data"]
    listener.unsubscribe()
    talker.unadvertise()
    return {"apart_s": _seconds(stamps[1]) - _seconds(stamps[0]), "said": said}


def _seconds(stamp: dict[str, int]) -> float:
    return stamp["sec"] + stamp["nanosec"] * 1e-9


def actions(ros: Any) -> dict[str, Any]:
    """A goal to its end, one that is canceled, one that is refused."""
    client = roslibpy.ActionClient(ros, "/fibonacci", "example_interfaces/action/Fibonacci")
    results: queue.Queue[Any] = queue.Queue()
    failures: queue.Queue[Any] = queue.Queue()
    steps: queue.Queue[Any] = queue.Queue()
    client.send_goal(roslibpy.Goal({"order": 4}), results.put, steps.put, failures.put)
    done = results.get(timeout=WAIT_S)
    fed = steps.qsize()
    goal = client.send_goal(roslibpy.Goal({"order": 10_000}), results.put, steps.put, failures.put)
    steps.get(timeout=WAIT_S)
    client.cancel_goal(goal)
    canceled = results.get(timeout=WAIT_S)
    client.send_goal(roslibpy.Goal({"order": -1}), results.put, steps.put, failures.put)
    failed = failures.get(timeout=WAIT_S)
    return {
        "done": [done["status"].value, done["values"]["sequence"]],
        "feedback": fed,
        "canceled": canceled["status"].value,
        "failed": failed["values"],
    }


def navigation(ros: Any) -> dict[str, Any]:
    """A robot drives to a pose, is stopped on its way to another, and told one where it cannot go."""
    client = roslibpy.ActionClient(ros, "/amigo_1/navigate_to_pose", "nav2_msgs/action/NavigateToPose")
    results: queue.Queue[Any] = queue.Queue()
    steps: queue.Queue[Any] = queue.Queue()

    def send(x_m: float) -> Any:
        position = {"x": x_m, "y": 1.5, "z": 0.0}
        pose = {"position": position, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
        goal = roslibpy.Goal({"pose": {"header": {"frame_id": "map"}, "pose": pose}, "behavior_tree": ""})
        return client.send_goal(goal, results.put, steps.put, results.put)

    send(1.6)
    done, fed = results.get(timeout=WAIT_S), list(steps.queue)
    steps.queue.clear()
    goal = send(4.0)
    for _ in range(5):
        steps.get(timeout=WAIT_S)
    client.cancel_goal(goal)
    canceled = results.get(timeout=WAIT_S)
    send(-50.0)
    failed = results.get(timeout=WAIT_S)
    return {
        "done": [done["status"].value, done["values"]["error_code"]],
        "remaining_m": [fed[0]["distance_remaining"], fed[-1]["distance_remaining"]],
        "x_m": fed[-1]["current_pose"]["pose"]["position"]["x"],
        "canceled": canceled["status"].value,
        "failed": [failed["status"].value, failed["values"]["error_code"]],
    }


def param(ros: Any) -> list[Any]:
    """A parameter set, read and deleted."""
    speed = roslibpy.Param(ros, "/speed")
    speed.set(0.5)
    value = speed.get()
    speed.delete()
    return [value, "/speed" in ros.get_params()]


def parallel(port: int, transport: str) -> int:
    """Thirty clients connect at once; how many then get an answer."""
    clients = [roslibpy.Ros("127.0.0.1", port, transport=transport) for _ in range(30)]
    ready = [threading.Event() for _ in clients]
    for client, event in zip(clients, ready, strict=True):
        client.on_ready(event.set)
    connected = sum(event.wait(WAIT_S) for event in ready)
    answered = sum("/rosout" in client.get_topics() for client in clients[:3])
    for client in clients:
        client.close()
    return connected if answered == 3 else 0


if __name__ == "__main__":
    json.dump(main(int(sys.argv[1]), sys.argv[2]), sys.stdout)
