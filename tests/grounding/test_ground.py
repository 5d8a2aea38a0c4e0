"""Stage 6: actions into calls, for every action of the shipped ontologies."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from types import MappingProxyType

import numpy as np
import pytest

from grounding.errors import GroundingError
from grounding.ground import ground, pose_of
from grounding.messages import (
    CameraInfo,
    Header,
    Image,
    LaserScan,
    MapMetaData,
    OccupancyGrid,
    Odometry,
    Path,
    PoseWithCovariance,
    RegionOfInterest,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    planar_pose,
    pose_stamped,
    stamp_of,
    xyyaw,
)
from kb.files import SHIPPED
from kb.store import KnowledgeBase, Snapshot
from kb.terms import Action, Argument, Data, Fluent, Value

HEADER: Header = header("map", 1.0)
ZERO = Vector3(x=0.0, y=0.0, z=0.0)
TWIST = Twist(linear=Vector3(x=0.25, y=0.0, z=0.0), angular=ZERO)
POSE = pose_stamped(1.0, 2.0, 0.5, t_s=1.0)
COVARIANCE = np.zeros(36)


def image(encoding: str) -> Image:
    """A picture of one black pixel."""
    return Image(
        header=HEADER, height=1, width=1, encoding=encoding, is_bigendian=0, step=4, data=np.zeros(4, dtype=np.uint8)
    )


MESSAGES: Mapping[str, object] = MappingProxyType(
    {
        "velocity": TWIST,
        "odometry": Odometry(
            header=HEADER,
            child_frame_id="amigo_1/base_link",
            pose=PoseWithCovariance(pose=planar_pose(0.0, 0.0, 0.0), covariance=COVARIANCE),
            twist=TwistWithCovariance(twist=TWIST, covariance=COVARIANCE),
        ),
        "color": image("rgb8"),
        "depth": image("32FC1"),
        "calibration": CameraInfo(
            header=HEADER,
            height=1,
            width=1,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=np.eye(3).ravel(),
            r=np.eye(3).ravel(),
            p=np.zeros(12),
            binning_x=0,
            binning_y=0,
            roi=RegionOfInterest(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
        ),
        "scan": LaserScan(
            header=HEADER,
            angle_min=0.0,
            angle_max=0.0,
            angle_increment=0.1,
            time_increment=0.0,
            scan_time=0.0,
            range_min=0.05,
            range_max=12.0,
            ranges=np.ones(1, dtype=np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        ),
        **dict.fromkeys(
            ("navMap", "locMap"),
            OccupancyGrid(
                header=HEADER,
                info=MapMetaData(
                    map_load_time=stamp_of(0.0), resolution=0.05, width=1, height=1, origin=planar_pose(0.0, 0.0, 0.0)
                ),
                data=np.zeros(1, dtype=np.int8),
            ),
        ),
        "path": Path(header=HEADER, poses=[POSE]),
        "pose": POSE,
        "lastPose": POSE,
    }
)
"""What earlier actions made, by the parameter that takes it."""

INDIVIDUALS = {"area": "tue_lab", "drink": "drink_1", "location": "at_bar"}
AMIGO_LASER = {"laser_x_m": 0.2, "laser_y_m": 0.0, "laser_yaw_rad": 0.0}

EXPECTED: dict[str, tuple[str, float, dict[str, object]]] = {
    "Base": ("/amigo_1/base", 1.0, {"velocity": TWIST}),
    "Kinect": ("/amigo_1/kinect", 2.0, {}),
    "Laser": ("/amigo_1/laser", 1.0, {}),
    "LocMap": ("/compute/loc_map", 5.0, {"map_file": "locMap.yaml"}),
    "NavMap": ("/compute/nav_map", 5.0, {"map_file": "navMap.yaml", "radius_m": 0.35}),
    "Path": (
        "/compute/path",
        5.0,
        {
            "map": MESSAGES["navMap"],
            "start": POSE,
            "goal": pose_stamped(7.5, 1.5, 1.5708, t_s=3.0),
            "scan": MESSAGES["scan"],
            "radius_m": 0.35,
            "tolerance_m": 1.0,
            **AMIGO_LASER,
        },
    ),
    "PoseAnywhere": (
        "/compute/pose_anywhere",
        20.0,
        {"map": MESSAGES["locMap"], "scan": MESSAGES["scan"], **AMIGO_LASER},
    ),
    "Pose": (
        "/compute/pose",
        2.0,
        {
            "map": MESSAGES["locMap"],
            "scan": MESSAGES["scan"],
            "last_pose": POSE,
            "odometry": MESSAGES["odometry"],
            **AMIGO_LASER,
        },
    ),
    "VelCmd": (
        "/compute/vel_cmd",
        1.0,
        {
            "path": MESSAGES["path"],
            "pose": POSE,
            "scan": MESSAGES["scan"],
            "max_vel_lin_mps": 0.7,
            "max_vel_ang_radps": 1.2,
            "radius_m": 0.35,
            **AMIGO_LASER,
        },
    ),
    "Detection": (
        "/compute/detection",
        5.0,
        {
            "color": MESSAGES["color"],
            "depth": MESSAGES["depth"],
            "camera_info": MESSAGES["calibration"],
            "pose": POSE,
            "hue_file": "HUE.yaml",
            "object_class": "Beer",
            "camera_x_m": 0.15,
            "camera_z_m": 1.2,
            "camera_pitch_rad": 0.45,
        },
    ),
}
"""Service, timeout in seconds and fields of each action of Amigo; files by their names."""


@pytest.fixture(scope="module")
def snapshot() -> Iterator[Snapshot]:
    """What is known of the shipped site."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge.snapshot()
    knowledge.close()


def action_of(process: str, snapshot: Snapshot, *, robot: str = "amigo_1", **given: Value) -> Action:
    """An action whose data are at places named `here/<parameter>`."""
    arguments = []
    for p in snapshot.processes[process].arguments:
        value = given.get(p.name, Data(f"here/{p.name}") if p.is_datum else {**INDIVIDUALS, "robot": robot}[p.name])
        arguments.append(Argument(name=p.name, role=p.role.value, value=value))
    return Action(id=f"task/{process}", process=process, robots=(robot,), arguments=tuple(arguments))


def at_places(**changed: object) -> dict[str, object]:
    """The messages by place, some of them changed or, with None, taken away."""
    return {f"here/{name}": m for name, m in {**MESSAGES, **changed}.items() if m is not None}


def test_every_grounded_process_is_expected(snapshot: Snapshot) -> None:
    """A new one has to be added to the table above."""
    assert set(snapshot.groundings) == set(EXPECTED)


@pytest.mark.parametrize("process", EXPECTED)
def test_an_action_becomes_a_call(snapshot: Snapshot, process: str) -> None:
    """Service of the robot, timeout, and each field of the request: messages as they are, the rest in SI units."""
    call = ground(action_of(process, snapshot), snapshot, at_places(), call_id=5, t_s=3.0)
    service, timeout_s, expected = EXPECTED[process]
    assert (call.id, call.service, call.timeout_s) == (5, service, timeout_s)
    assert set(call.fields) == set(expected)
    for name, value in expected.items():
        given = call.fields[name]
        if name.endswith("_file"):
            assert FilePath(str(given)) == SHIPPED / "sites" / "tue_lab" / str(value)
        elif any(value is message for message in MESSAGES.values()):
            assert given is value
        else:
            assert type(given) is type(value)
            assert given == value


def test_another_robot_has_its_own_service_and_measures(snapshot: Snapshot) -> None:
    """Pico is smaller and slower; the drink of the kitchen is of another class."""
    call = ground(action_of("VelCmd", snapshot, robot="pico_1"), snapshot, at_places(), call_id=1, t_s=3.0)
    assert (call.fields["radius_m"], call.fields["max_vel_lin_mps"]) == (0.3, 0.6)
    assert (
        ground(action_of("Laser", snapshot, robot="pico_1"), snapshot, {}, call_id=1, t_s=3.0).service
        == "/pico_1/laser"
    )
    look = action_of("Detection", snapshot, robot="pico_1", drink="drink_2")
    found = ground(look, snapshot, at_places(), call_id=1, t_s=3.0).fields
    assert found["object_class"] == snapshot.ontology.kind_of("drink_2") != "Beer"


@pytest.mark.parametrize("parameter", ["color", "depth", "calibration", "pose"])
def test_a_message_that_nobody_made_is_named(snapshot: Snapshot, parameter: str) -> None:
    """Process, field and parameter; the fault is the knowledge's, where the steps are put in order."""
    action = action_of("Detection", snapshot)
    [field] = [f.name for f in snapshot.groundings["Detection"].request if f.parameter == parameter]
    with pytest.raises(GroundingError) as caught:
        ground(action, snapshot, at_places(**{parameter: None}), call_id=1, t_s=3.0)
    assert (caught.value.process, caught.value.field, caught.value.fault) == ("Detection", field, "knowledge")
    assert (
        str(caught.value) == f'Detection, field {field}: {parameter} of Detection(amigo_1,"drink_1") has no value yet'
    )


def test_an_optional_message_may_be_missing(snapshot: Snapshot) -> None:
    """The first localization has no odometry yet: the field is there, without a value."""
    call = ground(action_of("Pose", snapshot), snapshot, at_places(odometry=None), call_id=1, t_s=3.0)
    assert call.fields["odometry"] is None
    assert set(call.fields) == set(EXPECTED["Pose"][2])


def test_a_message_of_another_type_is_refused(snapshot: Snapshot) -> None:
    """What is there and what should be."""
    with pytest.raises(
        GroundingError, match=r"Pose, field scan: the value is nav_msgs/Path, not sensor_msgs/LaserScan"
    ):
        ground(action_of("Pose", snapshot), snapshot, at_places(scan=MESSAGES["path"]), call_id=1, t_s=3.0)


def test_a_fluent_is_looked_up_at_its_place(snapshot: Snapshot) -> None:
    """The last pose is what was told last of the robot's pose estimate."""
    action = action_of("Pose", snapshot, lastPose=Fluent("hasPoseEstimate", "amigo_1"))
    other = pose_stamped(9.0, 9.0, 0.0, t_s=2.0)
    data = {**at_places(), "hasPoseEstimate(amigo_1)": other}
    assert ground(action, snapshot, data, call_id=1, t_s=3.0).fields["last_pose"] is other


def test_what_is_no_location_has_no_pose(snapshot: Snapshot) -> None:
    """A drink does not tell where a robot stands."""
    action = action_of("Path", snapshot, location="drink_1")
    with pytest.raises(GroundingError, match="Path, field goal: drink_1 is no Location, so it has no pose"):
        ground(action, snapshot, at_places(), call_id=1, t_s=3.0)


def test_a_property_that_the_individual_lacks_is_a_missing_value(snapshot: Snapshot) -> None:
    """A place has no radius."""
    action = action_of("NavMap", snapshot, robot="at_bar")
    with pytest.raises(
        GroundingError, match=r"NavMap, field radius_m: robot of NavMap\(at_bar,\"tue_lab\"\) has no value"
    ):
        ground(action, snapshot, {}, call_id=1, t_s=3.0)


def test_a_field_of_no_parameter_is_told(snapshot: Snapshot) -> None:
    """The grounding speaks of a parameter that the process does not have."""
    grounding = snapshot.groundings["Base"]
    [velocity] = grounding.request
    wrong = dataclasses.replace(grounding, request=(dataclasses.replace(velocity, parameter="speed"),))
    changed = dataclasses.replace(snapshot, groundings={**snapshot.groundings, "Base": wrong})
    with pytest.raises(GroundingError, match=r"Base, field velocity: Base\(amigo_1\) has no parameter 'speed'"):
        ground(action_of("Base", snapshot), changed, at_places(), call_id=1, t_s=3.0)


def test_a_location_is_where_the_site_says(snapshot: Snapshot) -> None:
    """In the map, with heading and stamp."""
    pose = pose_of("at_cabinet", snapshot, t_s=2.5)
    x_m, y_m, yaw_rad = xyyaw(pose.pose)
    assert (x_m, y_m) == (1.7, 4.0)
    assert math.remainder(yaw_rad - 3.1416, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert (pose.header.frame_id, pose.header.stamp) == ("map", stamp_of(2.5))
