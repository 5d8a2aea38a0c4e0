"""Boxes, cylinders and spheres somewhere in space: how far they reach around the upright axis, and how high."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """What shapes need: the circle around the z axis that they stay in, and from where to where they go along it."""

    radius_m: float
    lowest_m: float
    highest_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A frame, and a solid in it.

    Attributes:
        pose: 4 x 4, from the frame to that of the root; the frame is in the middle of the solid.
        corners: N x 3 points whose hull, widened by `around_m`, holds the solid; in the frame.
    """

    pose: Matrix
    corners: Matrix
    around_m: float = 0.0

    @classmethod
    def at_origin(cls) -> Self:
        """A frame without a solid."""
        return cls(np.eye(4), np.zeros((1, 3)))

    def moved(self, xyz_m: Sequence[float], rpy_rad: Sequence[float]) -> Shape:
        """A frame at a pose in this one: fixed-axis roll, pitch, yaw, as in URDF."""
        (cr, cp, cy), (sr, sp, sy) = np.cos(rpy_rad), np.sin(rpy_rad)
        step = np.eye(4)
        step[:3, :3] = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
        step[:3, 3] = xyz_m
        return Shape(self.pose @ step, np.zeros((1, 3)))

    def box(self, size_m: Sequence[float]) -> Shape:
        """A box in the frame."""
        signs = np.array(list(product((-0.5, 0.5), repeat=3)))
        return Shape(self.pose, signs * np.asarray(size_m, dtype=float))

    def cylinder(self, radius_m: float, length_m: float) -> Shape:
        """A cylinder along z: its rims by 64 corners each, which is right to 0.2 % of the radius."""
        angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        rim = np.stack([np.cos(angles) * radius_m, np.sin(angles) * radius_m], axis=1)
        ends = [np.column_stack([rim, np.full(64, z)]) for z in (-length_m / 2, length_m / 2)]
        return Shape(self.pose, np.concatenate(ends))

    def sphere(self, radius_m: float) -> Shape:
        """A sphere."""
        return Shape(self.pose, np.zeros((1, 3)), radius_m)


def extent(shapes: Sequence[Shape]) -> Extent | None:
    """What shapes need together; None if there are none."""
    if not shapes:
        return None
    placed = [(s.corners @ s.pose[:3, :3].T + s.pose[:3, 3], s.around_m) for s in shapes]
    return Extent(
        radius_m=max(float(np.hypot(p[:, 0], p[:, 1]).max()) + r for p, r in placed),
        lowest_m=min(float(p[:, 2].min()) - r for p, r in placed),
        highest_m=max(float(p[:, 2].max()) + r for p, r in placed),
    )
