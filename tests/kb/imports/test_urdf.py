"""URDF robot models become robot classes to review."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from kb.imports.report import Fate, Imported, NotImportable
from kb.imports.urdf import import_urdf
from kb.ontology import Value
from kb.writing import Entity, Has, Sort
from tests.kb.imports.worlds import BASE, IRI, loaded, told

MODELS = Path(__file__).parents[3] / "sim" / "models"
CART = """<?xml version="1.0"?>
<robot name="cart">
  <link name="base_link">
    <inertial><mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.1 0 0.2"/><geometry><box size="0.6 0.4 0.4"/></geometry></collision></link>
  <link name="plate"><collision><origin xyz="0 0 0.05"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="arm_1"><inertial><mass value="2.5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><cylinder radius="0.05" length="1.0"/></geometry></visual></link>
  <link name="eye"/>
  <joint name="fix" type="fixed"><parent link="base_link"/><child link="plate"/><origin xyz="0 -0.5 0.4"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base_link"/><child link="arm_1"/>
    <origin xyz="0 0 1.0" rpy="0 1.5707963267948966 0"/>
    <limit lower="-1.5" upper="2.0" effort="30" velocity="1.2"/></joint>
  <joint name="lift" type="prismatic"><parent link="arm_1"/><child link="eye"/>
    <limit lower="0" upper="0.3" effort="100" velocity="0"/></joint>
  <gazebo reference="eye"><sensor type="depth" name="d"/></gazebo>
  <transmission name="t"/>
</robot>
"""


def imported(text: str, folder: Path) -> Imported:
    """A model of this text."""
    file = folder / "cart.urdf"
    file.write_text(text, encoding="utf-8")
    return import_urdf(file, IRI)


def figures(model: Imported) -> dict[str, Value]:
    """Numbers of the robot class."""
    return {
        r.prop.rpartition("#")[2]: r.value
        for e in model.entities
        if e.sort is Sort.CLASS
        for r in e.above
        if isinstance(r, Has)
    }


def test_a_model(tmp_path: Path) -> None:
    """Size, mass, sensors, links and joints with their limits are in the file, which passes the check."""
    model = imported(CART, tmp_path)
    one = Entity(iri=f"{BASE}/trial.owl#cart_1", sort=Sort.INDIVIDUAL, types=(f"{IRI}#Cart",))
    with loaded(model, tmp_path / "kb", (one,)) as snapshot:
        ontology = snapshot.ontology
        assert ontology.value("mass_kg", "cart_1") == 12.5
        assert ontology.value("mass_kg", "Cart_arm_1") == 2.5
        shoulder = {p: ontology.value(p, "Cart_shoulder") for p in ("lowerLimit_rad", "upperLimit_rad", "maxTorque_Nm")}
        assert shoulder == {"lowerLimit_rad": -1.5, "upperLimit_rad": 2.0, "maxTorque_Nm": 30.0}
        assert ontology.value("maxJointVel_radps", "Cart_shoulder") == 1.2
        assert ontology.value("upperLimit_m", "Cart_lift") == 0.3
        assert ontology.value("maxForce_N", "Cart_lift") == 100.0
        assert ontology.value("maxJointVel_mps", "Cart_lift") is None
        assert ontology.value("childLink", "Cart_lift") == "Cart_eye"
        kind = next(e for e in model.entities if e.iri == f"{IRI}#Cart")
        assert {getattr(a, "kind", "").rpartition("#")[2] for a in kind.above} >= {"DepthCamera", "Cart_Arm"}
    assert "cart.urdf:7 guessed: arm_1: that it has a Arm follows from names alone" in told(model, Fate.GUESSED)
    left_out = told(model, Fate.LEFT_OUT)
    assert "cart.urdf:14 left out: lift: velocity=0" in left_out
    assert "1 elements <transmission>: there is no place" in left_out
    assert "1 elements <gazebo>: which sensors are in them became what the class has" in left_out
    assert "2 elements <origin>: they count for footprint and height" in left_out
    assert "nothing tells what it drives with" in left_out


def test_size(tmp_path: Path) -> None:
    """The footprint holds base and what is fixed to it, not the arm; the height is that of all, turned as it is."""
    found = figures(imported(CART, tmp_path))
    assert found["radius_m"] == pytest.approx(max(math.hypot(0.4, 0.2), 0.55), abs=1e-4)
    assert found["height_m"] == pytest.approx(1.05, abs=1e-3)  # the arm lies level at 1.0 m
    upright = figures(imported(CART.replace('rpy="0 1.5707963267948966 0"', ""), tmp_path))
    assert upright["height_m"] == pytest.approx(1.5)


@pytest.mark.parametrize(("name", "radius_m", "height_m"), [("pico", 0.30, 1.16), ("amigo", 0.35, 1.3)])
def test_models_of_the_simulator(name: str, radius_m: float, height_m: float, tmp_path: Path) -> None:
    """The simulator's robots have the radius that the shipped ontologies give them."""
    model = import_urdf(MODELS / f"{name}.urdf", IRI)
    assert figures(model) == {"radius_m": radius_m, "height_m": height_m, "mass_kg": 50.0 if name == "pico" else 80.0}
    assert "LaserScanner follows from names alone: laser" in told(model, Fate.GUESSED)
    with loaded(model, tmp_path / "kb"):
        pass


LIMIT = '<limit lower="-1.5" upper="2.0" effort="30" velocity="1.2"/>'


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("</robot>", "", ":19 does not parse as XML: no element found"),
        (
            "<robot ",
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="a"/></robot><robot ',
            ":2 is a xacro",
        ),
        ('value="10"', 'value="${m}"', ":4 is a xacro file"),
        ('<?xml version="1.0"?>', "<!DOCTYPE robot [<!ENTITY a 'b'>]>", ":1 has a DOCTYPE"),
        ("robot", "sdf", ":1 is no URDF: its outermost element is <sdf>"),
        ('<child link="plate"/>', '<child link="palte"/>', ":10 joint fix: its child 'palte' is no link of this file"),
        ('<link name="eye"/>', '<link name="plate"/>', ":9 a second link is called plate, as that of line 6"),
        ('name="lift"', 'name="fix"', ":14 a second joint is called fix, as that of line 10"),
        ('<child link="plate"/>', '<child link="eye"/>', "joint lift: its child eye hangs on the joint fix already"),
        ('<parent link="base_link"/><child link="plate"/>', '<parent link="plate"/><child link="plate"/>', "circle"),
        (
            '<link name="eye"/>',
            '<link name="eye"/><link name="lost"/>',
            "2 links that hang on no joint, base_link, lost",
        ),
        (LIMIT, LIMIT.replace("-1.5", "3.0"), ":11 joint shoulder: its lower limit 3 is above the upper one, 2"),
        (LIMIT, LIMIT.replace("2.0", "2e9"), ":11 joint shoulder: has limits -1.5 and 2e+09 rad"),
        (LIMIT, LIMIT.replace("30", "-30"), ":11 joint shoulder: has the limit effort=-30"),
        (LIMIT, LIMIT.replace("30", "inf"), ":11 joint shoulder: has the limit effort=inf"),
        (LIMIT, LIMIT.replace("30", "much"), ":11 is no URDF"),
        (LIMIT, "<limit/>", ":11 is no URDF"),
        ('type="revolute"', 'type="rotary"', "is no URDF: "),
        ('value="10"', 'value="-10"', ":3 link base_link: has the mass -10"),
        (
            'radius="0.05"/></geometry></coll',
            'radius="-1"/></geometry></coll',
            ":6 link plate: has a shape of the size -1",
        ),
        ('xyz="0 0 0.05"', 'xyz="nan 0 0"', ":6 link plate: has an origin of xyz [nan, 0.0, 0.0]"),
        ('rpy="0 1.5707963267948966 0"', 'rpy="0 1e999 0"', ":11 joint shoulder: has an origin of xyz"),
        ("<sphere radius=", "<blob radius=", "is no URDF: Invalid geometric tag: blob"),
    ],
)
def test_faults(old: str, new: str, says: str, tmp_path: Path) -> None:
    """Each fault has one message with its place."""
    assert old in CART
    with pytest.raises(NotImportable) as raised:
        imported(CART.replace(old, new, 1) if old != "robot" else CART.replace(old, new), tmp_path)
    assert says in str(raised.value)
    assert "\n" not in str(raised.value)


def test_meshes_are_told_of(tmp_path: Path) -> None:
    """A mesh has no size that we know; without any other shape there is no footprint, and the report says so."""
    text = '<robot name="a"><link name="b"><collision><geometry><mesh filename="package://x/b.stl"/></geometry></collision></link></robot>'
    model = imported(text, tmp_path)
    assert figures(model) == {}
    left_out = told(model, Fate.LEFT_OUT)
    assert "the mesh b.stl is not read" in left_out
    assert "add radius_m to the class" in left_out
