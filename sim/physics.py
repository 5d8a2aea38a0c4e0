"""The physics engine: the only module that speaks to PyBullet.

Bodies stand or drive on the plane z = 0: there is no gravity, robots are pushed by setting their velocity, and
whatever a contact does to height or tilt is undone after the step. So the floor needs no collision shape, and a
body that is in nobody's way moves exactly as it is told.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.world import Box, Color, Point3


@contextlib.contextmanager
def _stderr_closed() -> Iterator[None]:
    """Importing pybullet writes its build time straight to file descriptor 2; nobody wants to read that."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


with _stderr_closed():
    import pybullet

Body = int
Floats = NDArray[np.float64]

_NOTHING_SEEN = 1.0 - 2.0**-23  # the renderer clears its depth buffer to 1 - 2^-24, the float before 1
_NEAR_M = 0.02
_TOUCH_M = 0.001  # bodies this close touch; the engine lets them overlap by some millimeters on impact


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """Where a sensor sits: position (3,) in m and rotation (3, 3) of its frame in base_link."""

    position: Floats
    rotation: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanarState:
    """Pose and velocity of a body on the floor, both in map: m, m, rad, m/s, m/s, rad/s. Yaw in (-pi, pi]."""

    x_m: float
    y_m: float
    yaw_rad: float
    vx_mps: float
    vy_mps: float
    wz_radps: float


class Physics:
    """One PyBullet world without a window, with its own client.

    Args:
        step_s: Length of a step. The engine is deterministic: same calls, same result, bit for bit.
    """

    def __init__(self, step_s: float) -> None:
        self._client: int = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=step_s, deterministicOverlappingPairs=1, physicsClientId=self._client
        )

    def close(self) -> None:
        """Free the world. Nothing else may be called afterwards."""
        pybullet.disconnect(physicsClientId=self._client)

    def add_box(self, box: Box) -> Body:
        """Add a box that stands still."""
        half, center = _half_and_center(box)
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client)
        return self._add_still(shape, self._box_looks(half, box.color), center)

    def add_floor(self, box: Box) -> Body:
        """Add a box that is seen by cameras only."""
        half, center = _half_and_center(box)
        return self._add_still(-1, self._box_looks(half, box.color), center)

    def add_cylinder(self, bottom: Point3, radius_m: float, height_m: float, color: Color) -> Body:
        """Add an upright cylinder that stands still; `bottom` is the center of its bottom."""
        client = self._client
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER, radius=radius_m, height=height_m, physicsClientId=client
        )
        looks = pybullet.createVisualShape(
            pybullet.GEOM_CYLINDER, radius=radius_m, length=height_m, rgbaColor=(*color, 1.0), physicsClientId=client
        )
        return self._add_still(shape, looks, (bottom[0], bottom[1], bottom[2] + height_m / 2))

    def add_robot(self, urdf_file: str) -> Body:
        """Add a robot at the origin of the map; its mass has to be at the origin of its base_link."""
        # Without the flag the engine makes a many-sided prism of a cylinder.
        body: int = pybullet.loadURDF(
            urdf_file, flags=pybullet.URDF_USE_IMPLICIT_CYLINDER, physicsClientId=self._client
        )
        # Speed is what the drive makes it; only contacts may take some away, and they neither bounce nor stick.
        pybullet.changeDynamics(
            body,
            -1,
            linearDamping=0,
            angularDamping=0,
            restitution=0,
            lateralFriction=0.1,
            physicsClientId=self._client,
        )
        return body

    def footprint_radius_m(self, robot: Body) -> float:
        """Radius of the robot's collision cylinder."""
        (shape,) = pybullet.getCollisionShapeData(robot, -1, physicsClientId=self._client)
        assert shape[2] == pybullet.GEOM_CYLINDER, "the collision shape of a robot is one cylinder"
        return float(shape[3][1])

    def top_m(self, robot: Body) -> float:
        """Height of a robot that was just added."""
        _, high = pybullet.getAABB(robot, physicsClientId=self._client)
        return float(high[2])

    def mount(self, robot: Body, link_name: str) -> Mount:
        """Where link `link_name` sits on a robot that was just added."""
        client = self._client
        for link in range(pybullet.getNumJoints(robot, physicsClientId=client)):
            if pybullet.getJointInfo(robot, link, physicsClientId=client)[12] == link_name.encode():
                state = pybullet.getLinkState(robot, link, computeForwardKinematics=1, physicsClientId=client)
                rotation = pybullet.getMatrixFromQuaternion(state[5])
                return Mount(position=np.array(state[4]), rotation=np.array(rotation).reshape(3, 3))
        raise AssertionError(f"a robot model has no link {link_name}")

    def place(self, robot: Body, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Put a robot somewhere, at rest."""
        turn = (0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))
        pybullet.resetBasePositionAndOrientation(robot, (x_m, y_m, 0.0), turn, physicsClientId=self._client)

    def move(self, body: Body, center: Point3) -> None:
        """Put a body that stands still somewhere else, upright."""
        pybullet.resetBasePositionAndOrientation(body, center, (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client)

    def near(self, body: Body, robot: Body) -> bool:
        """Whether a robot touches a body where both are now, or nearly does."""
        return bool(pybullet.getClosestPoints(body, robot, _NEAR_M, physicsClientId=self._client))

    def push(self, robot: Body, vx_mps: float, vy_mps: float, wz_radps: float) -> None:
        """Set the velocity (map) with which a robot enters the next step."""
        pybullet.resetBaseVelocity(robot, (vx_mps, vy_mps, 0.0), (0.0, 0.0, wz_radps), physicsClientId=self._client)

    def step(self) -> None:
        """Let one step of time pass."""
        pybullet.stepSimulation(physicsClientId=self._client)

    def settle(self, robot: Body) -> PlanarState:
        """Pose and velocity of a robot after a step; puts it back on the floor if a contact lifted or tilted it."""
        (x, y, z), (qx, qy, qz, qw) = pybullet.getBasePositionAndOrientation(robot, physicsClientId=self._client)
        (vx, vy, _), (_, _, wz) = pybullet.getBaseVelocity(robot, physicsClientId=self._client)
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        if z != 0.0 or qx != 0.0 or qy != 0.0:
            self.place(robot, x, y, yaw)
        return PlanarState(x_m=x, y_m=y, yaw_rad=yaw, vx_mps=vx, vy_mps=vy, wz_radps=wz)

    def position(self, body: Body) -> Point3:
        """Center of a body that stands still."""
        center, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        return float(center[0]), float(center[1]), float(center[2])

    def touches(self, robot: Body) -> bool:
        """Whether a robot touched anything in the last step."""
        contacts = pybullet.getContactPoints(bodyA=robot, physicsClientId=self._client)
        return any(contact[8] <= _TOUCH_M for contact in contacts)

    def overlaps(self, robot: Body) -> bool:
        """Whether a robot is in something where it is now (without a step)."""
        pybullet.performCollisionDetection(physicsClientId=self._client)
        return self.touches(robot)

    def cast(self, starts: Floats, ends: Floats) -> Floats:
        """Fractions (n,) of the way at which the rays from `starts` (n, 3) to `ends` (n, 3) hit; +inf for no hit."""
        hits = pybullet.rayTestBatch(starts.tolist(), ends.tolist(), numThreads=1, physicsClientId=self._client)
        return np.array([hit[2] if hit[0] >= 0 else math.inf for hit in hits])

    def render(
        self,
        eye: Floats,
        forward: Floats,
        up: Floats,
        *,
        width: int,
        height: int,
        fov_y_rad: float,
        near_m: float,
        far_m: float,
    ) -> tuple[NDArray[np.uint8], Floats]:
        """See the world from `eye` along `forward` (3,) with `up` (3,) up, all in map.

        Returns:
            Colors (height, width, 3) and depths (height, width) along `forward` in m, +inf where nothing is nearer
            than `far_m`. First row on top. The software renderer samples pixel (row, column) where the direction
            has image coordinates (column - width/2, row - (height/2 - 1)): that is the principal point.
        """
        client = self._client
        view = pybullet.computeViewMatrix(eye.tolist(), (eye + forward).tolist(), up.tolist(), physicsClientId=client)
        projection = pybullet.computeProjectionMatrixFOV(
            math.degrees(fov_y_rad), width / height, near_m, far_m, physicsClientId=client
        )
        # Matte surfaces without shadows keep the hue of their color.
        _, _, rgba, buffer, _ = pybullet.getCameraImage(
            width,
            height,
            view,
            projection,
            lightDirection=(4.0, 3.0, 8.0),
            lightAmbientCoeff=0.65,
            lightDiffuseCoeff=0.35,
            lightSpecularCoeff=0.0,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=client,
        )
        colors = np.asarray(rgba, dtype=np.uint8).reshape(height, width, 4)[:, :, :3]
        # The inverse of the projection: buffer 0 at near_m, 1 at far_m.
        scaled = np.asarray(buffer, dtype=np.float64).reshape(height, width)
        depths = far_m * near_m / (far_m - (far_m - near_m) * scaled)
        depths[scaled >= _NOTHING_SEEN] = math.inf
        return colors, depths

    def _box_looks(self, half: Point3, color: Color) -> int:
        looks: int = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half, rgbaColor=(*color, 1.0), physicsClientId=self._client
        )
        return looks

    def _add_still(self, shape: int, looks: int, center: Point3) -> Body:
        body: int = pybullet.createMultiBody(
            baseMass=0.0,
            baseCollisionShapeIndex=shape,
            baseVisualShapeIndex=looks,
            basePosition=center,
            physicsClientId=self._client,
        )
        return body


def _half_and_center(box: Box) -> tuple[Point3, Point3]:
    (x0, y0, z0), (x1, y1, z1) = box.low, box.high
    return ((x1 - x0) / 2, (y1 - y0) / 2, (z1 - z0) / 2), ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
