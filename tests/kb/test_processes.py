from kb.processes import Role, realizing
from kb.store import KnowledgeBase


def test_parameters_are_in_the_order_of_their_numbers(shipped: KnowledgeBase) -> None:
    """Robot first, then what goes in, then what comes out; locals are no arguments."""
    search = shipped.snapshot().processes["SearchDrink"]
    assert [p.name for p in search.arguments] == ["robot", "area", "drink", "location", "position"]
    assert [p.name for p in search.inputs] == ["robot", "area", "drink", "location"]
    assert [p.name for p in search.outputs] == ["position"]
    assert {p.name for p in search.parameters} - {p.name for p in search.arguments} == {
        "scan",
        "pose",
        "color",
        "depth",
        "calibration",
    }


def test_a_parameter_knows_what_it_holds(shipped: KnowledgeBase) -> None:
    """Role, class, and whether it is a message."""
    detection = shipped.snapshot().processes["Detection"]
    drink, pose = detection.parameter("drink"), detection.parameter("pose")
    assert drink is not None
    assert pose is not None
    assert (drink.role, drink.kind, drink.is_datum) == (Role.INPUT, "Drink", False)
    assert (pose.role, pose.kind, pose.is_datum) == (Role.INPUT, "PoseEstimate", True)
    assert detection.parameter("nothing") is None


def test_the_robot_of_a_process(shipped: KnowledgeBase) -> None:
    """A task for a fleet has none: its robot is picked, a local."""
    processes = shipped.snapshot().processes
    assert processes["FindEmptyDrink"].robot is None
    for name in ("Laser", "Base", "Kinect", "Navigate", "SearchDrink"):
        robot = processes[name].robot
        assert robot is not None
        assert (robot.name, robot.role) == ("robot", Role.ROBOT)


def test_atomic_and_composite(shipped: KnowledgeBase) -> None:
    """What is grounded, and what is composed."""
    snapshot = shipped.snapshot()
    atomic = {name for name, process in snapshot.processes.items() if process.is_atomic}
    assert atomic == set(snapshot.groundings)
    composite = {"FindEmptyDrink", "FindEachDrink", "SearchDrink", "Navigate", "Localize", "MakeRoom", "Relocalize"}
    assert set(snapshot.processes) - atomic == composite


def test_the_processes_that_accomplish_a_task(shipped: KnowledgeBase) -> None:
    """By name; a process that realizes another task, or none, is not among them."""
    ontology = shipped.snapshot().ontology
    assert realizing(ontology, "FindEmptyDrink") == ["FindEachDrink"]
    assert realizing(ontology, "Navigate") == []
