"""A robot of ROS 1 as anyone writes it: rospy and actionlib. Run by the system's Python; says when it is ready."""

import sys
import threading

import rospy
from actionlib import ActionServer, SimpleActionServer
from actionlib.msg import TestAction, TestFeedback, TestResult
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse


def _hang(request: object) -> TriggerResponse:
    threading.Event().wait()
    return TriggerResponse()


def _set(request: SetBool) -> SetBoolResponse:
    if not request.data:
        raise rospy.ServiceException("BaseMoves: stop first")
    return SetBoolResponse(success=True, message="set")


class _Test:
    """Even goals succeed, odd ones fail, negative ones last until they are canceled."""

    def __init__(self) -> None:
        self._server = SimpleActionServer("/robot/test", TestAction, self._do, auto_start=False)
        self._server.start()

    def _do(self, goal: TestAction) -> None:
        self._server.publish_feedback(TestFeedback(feedback=goal.goal + 1))
        if goal.goal < 0:
            canceled = threading.Event()
            self._server.register_preempt_callback(canceled.set)
            canceled.wait()
            self._server.set_preempted(TestResult(result=-1), "enough")
        elif goal.goal % 2:
            self._server.set_aborted(TestResult(result=goal.goal), "NoPath: there is a wall")
        else:
            self._server.set_succeeded(TestResult(result=goal.goal), "done")


rospy.init_node("stock_robot")
rospy.Service("/robot/trigger", Trigger, lambda request: TriggerResponse(success=True, message="ok"))
rospy.Service("/robot/hang", Trigger, _hang)
rospy.Service("/robot/set", SetBool, _set)
echo = rospy.Publisher("/robot/echo", LaserScan, queue_size=10)
rospy.Subscriber("/robot/scan", LaserScan, echo.publish)
_Test()
refusing = ActionServer(
    "/robot/refuse", TestAction, lambda goal: goal.set_rejected(TestResult(), "not now"), auto_start=False
)
refusing.start()
sys.stdout.write("ready\n")
sys.stdout.flush()
rospy.spin()
