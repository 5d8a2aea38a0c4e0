from contextlib import closing
from pathlib import Path

import pytest

from grounding import messages
from kb.files import SHIPPED
from kb.groundings import must_offer
from kb.store import KnowledgeBase
from tests.scenarios.laser_topic import ground_laser_in_topic

PLAIN = {"bool", "float64", "int64", "string"}


def test_a_robot_service(shipped: KnowledgeBase) -> None:
    """Name with a place for the robot's, duration and time limit in seconds, typed fields."""
    base = shipped.snapshot().groundings["Base"]
    assert (base.service, base.on_robot, base.timeout_s, base.duration_s) == ("/{robot}/base", True, 1.0, 0.004)
    assert [(f.name, f.message_type, f.parameter) for f in base.request] == [
        ("velocity", "geometry_msgs/Twist", "velocity")
    ]
    assert [(f.name, f.message_type, f.parameter) for f in base.reply] == [
        ("odometry", "nav_msgs/Odometry", "odometry")
    ]


def test_a_compute_service(shipped: KnowledgeBase) -> None:
    """Fields carry messages, properties of the robot, the class of a thing, files of the site."""
    detection = shipped.snapshot().groundings["Detection"]
    assert (detection.service, detection.on_robot) == ("/compute/detection", False)
    fields = {f.name: f for f in detection.request}
    assert list(fields) == sorted(fields)
    assert fields["color"].parameter == "color"
    assert (fields["camera_x_m"].parameter, fields["camera_x_m"].of_property) == ("robot", "cameraX_m")
    assert (fields["object_class"].parameter, fields["object_class"].kind_of) == ("drink", True)
    assert fields["hue_file"].file == SHIPPED / "sites" / "tue_lab" / "HUE.yaml"


def test_a_topic(folder: Path) -> None:
    """Name with a place for the robot's, the age that a message may have, and the one message."""
    ground_laser_in_topic(folder, max_age_s=0.15)
    with closing(KnowledgeBase("tue_lab", folder)) as knowledge:
        snapshot = knowledge.snapshot()
        laser = snapshot.groundings["Laser"]
        assert (laser.service, laser.on_robot, laser.is_topic) == ("/{robot}/scan", True, True)
        assert (laser.max_age_s, laser.timeout_s, laser.request) == (0.15, 1.0, ())
        (scan,) = laser.reply
        assert (scan.message_type, scan.parameter) == ("sensor_msgs/LaserScan", "scan")
        assert [g.process for g in snapshot.groundings.values() if g.is_topic] == ["Laser"]
        assert must_offer(snapshot.ontology, "amigo_1", laser)


def test_every_message_type_is_one_that_we_speak(shipped: KnowledgeBase) -> None:
    """The ontology names no message that `grounding.messages` does not have."""
    types = {f.message_type for g in shipped.snapshot().groundings.values() for f in (*g.request, *g.reply)}
    for name in types - PLAIN:
        assert name.partition("/")[2] in messages.__all__, name


def test_travel_times_are_asked_of_a_service(shipped: KnowledgeBase) -> None:
    """How long a robot travels follows from its map, radius and speed."""
    (estimate,) = shipped.snapshot().travel_estimates
    assert estimate.service == "/compute/travel"
    assert {f.name: f.of_property for f in estimate.request} == {
        "map_file": None,
        "max_vel_lin_mps": "maxVelLin_mps",
        "radius_m": "radius_m",
    }


@pytest.mark.parametrize("robot", ["amigo_1", "pico_1"])
def test_every_robot_has_what_requests_ask_of_it(robot: str, shipped: KnowledgeBase) -> None:
    """Each property that a request takes from the robot is a number."""
    snapshot = shipped.snapshot()
    asked = {f.of_property for g in snapshot.groundings.values() for f in g.request if f.parameter == "robot"}
    assert asked >= {"radius_m", "laserX_m", "maxVelLin_mps"}
    for prop in asked - {None}:
        assert isinstance(snapshot.value(str(prop), robot), float), prop
