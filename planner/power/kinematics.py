"""Wheel layouts: how body motion turns wheels and rollers, and how wheel forces add up.

A wheel stands at (x, y) with rolling direction e. Its contact roller has its axle along the unit
vector a and rolls freely along p ⟂ a. With the velocity c of the ground point under the hub,
c = (vx - wz·y, vy + wz·x):

    rim speed      r·ω = (c·a) / (e·a)          no slip along the roller's axle
    roller speed   u   = (c - r·ω·e)·p          what is left is rolled off by the roller
    force          f·a + g·p                    f is held by the axle, g is the roller's drag
    hub torque     r·(f·a + g·p)·e

Mecanum: four wheels with e = (1, 0) and the axle at 45°; the contact rollers form an O seen from
above (with an X the yaw lever would be the difference of half wheelbase and half track). Omni: n
wheels on a circle with the axle along e. ``roller_angle`` is the angle between the roller's axle
and the wheel's axle: 45° for Mecanum, 90° for omni wheels.

Distribution of a required resultant over n axle forces is the least-squares one (least copper
loss); with four wheels one null mode is left, in which the wheels fight each other.
Normal loads are those of equal springs under all wheels.

Sources: Muir & Neuman, "Kinematic modeling of wheeled mobile robots", 1987 (least squares);
roller speed, loads and null mode are derived here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Columns of WheelLayout.table, one row a wheel.
X, Y = 0, 1  # m, from the centre
RIM_VX, RIM_VY, RIM_WZ = 2, 3, 4  # 1, 1, m: r·ω = RIM · (vx, vy, wz)
ROLLER_VX, ROLLER_VY, ROLLER_WZ = 5, 6, 7  # 1, 1, m: u = ROLLER · (vx, vy, wz)
AXIS_FX, AXIS_FY, AXIS_MZ = 8, 9, 10  # 1, 1, 1/m: f = FORCE · (Fx, Fy, Mz)
DRAG_FX, DRAG_FY, DRAG_MZ = 11, 12, 13  # 1, 1, m: (Fx, Fy, Mz) of 1 N of roller drag along p
AXIS_LEVER, DRAG_LEVER = 14, 15  # 1: a·e and p·e
LOAD_SHARE, LOAD_X, LOAD_Y = 16, 17, 18  # 1, 1/m, 1/m: N = m·g_n · LOAD · (1, x_cp, y_cp)
NULL = 19  # 1: share of the wheel in the null mode, as a force f; 0 without one
RIM, ROLLER, FORCE, DRAG, LOAD = RIM_VX, ROLLER_VX, AXIS_FX, DRAG_FX, LOAD_SHARE
# The first of three columns each.
COLUMNS = 20


@dataclass(frozen=True)
class WheelLayout:
    """Geometry of all wheels as the table of coefficients that the power kernel reads.

    Attributes:
        table: (n, COLUMNS) coefficients, see the module's constants.
        radius: wheel radius, m.
    """

    table: NDArray[np.float64]
    radius: float

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        return len(self.table)

    @property
    def roller_angle(self) -> float:
        """Angle between the axles of roller and wheel, rad, up to π/2."""
        return math.asin(min(1.0, abs(float(self.table[0, AXIS_LEVER]))))

    def wheel_speeds(self, vx: float, vy: float, wz: float) -> NDArray[np.float64]:
        """Angular speeds of the wheels, rad/s, shape (n,)."""
        speeds: NDArray[np.float64] = self.table[:, RIM : RIM + 3] @ np.array([vx, vy, wz])
        return speeds / self.radius

    @property
    def rolling(self) -> NDArray[np.float64]:
        """Directions in which the wheels roll, rad from the body's x, (n,)."""
        lever, drag = self.table[:, AXIS_LEVER], self.table[:, DRAG_LEVER]
        ax, ay = self.table[:, RIM_VX] * lever, self.table[:, RIM_VY] * lever
        # Out of the parts along the roller's axle and across it.
        directions: NDArray[np.float64] = np.arctan2(lever * ay + drag * ax, lever * ax - drag * ay)
        return directions

    def stretched(self, along: float, across: float) -> WheelLayout:
        """The same wheels, turned as they are, at other places.

        Args:
            along, across: factors on the places forward and to the left.
        """
        wheels = []
        for row, rolling in zip(self.table, self.rolling, strict=True):
            axle = (row[RIM_VX] * row[AXIS_LEVER], row[RIM_VY] * row[AXIS_LEVER])
            wheels.append((row[X] * along, row[Y] * across, float(rolling), axle))
        return _layout(wheels, self.radius)


def mecanum(
    *, half_wheelbase: float, half_track: float, radius: float, roller_angle: float = math.pi / 4
) -> WheelLayout:
    """Four Mecanum wheels, in the order front left, front right, rear left, rear right.

    Args:
        half_wheelbase: m, centre to axle.
        half_track: m, centre to the middle of a wheel.
        radius: m.
        roller_angle: rad between roller axle and wheel axle, 45° for the usual wheel.
    """
    along, across = math.sin(roller_angle), math.cos(roller_angle)
    wheels = [
        (half_wheelbase * front, half_track * left, 0.0, (along, -front * left * across))
        for front in (1, -1)
        for left in (1, -1)
    ]
    return _layout(wheels, radius)


def omni(
    *,
    base_radius: float,
    angles: tuple[float, ...],
    radius: float,
    roller_angle: float = math.pi / 2,
) -> WheelLayout:
    """Wheels on a circle, each rolling along the tangent (counter-clockwise positive).

    Args:
        base_radius: m, centre to the middle of a wheel.
        angles: rad, direction from the centre to each wheel; at least three.
        radius: m.
        roller_angle: rad between roller axle and wheel axle, 90° for the usual omni wheel.
    """
    if len(angles) < 3:
        raise ValueError("an omni layout needs at least three wheels")
    along, across = math.sin(roller_angle), math.cos(roller_angle)
    wheels = []
    for angle in angles:
        c, s = math.cos(angle), math.sin(angle)
        tangent, outward = (-s, c), (c, s)
        axle = (along * tangent[0] + across * outward[0], along * tangent[1] + across * outward[1])
        wheels.append((base_radius * c, base_radius * s, angle + math.pi / 2, axle))
    return _layout(wheels, radius)


def _layout(
    wheels: list[tuple[float, float, float, tuple[float, float]]], radius: float
) -> WheelLayout:
    n = len(wheels)
    table = np.zeros((n, COLUMNS))
    resultant = np.empty((3, n))
    for i, (x, y, rolling, (ax, ay)) in enumerate(wheels):
        ex, ey = math.cos(rolling), math.sin(rolling)
        px, py = -ay, ax
        lever = ax * ex + ay * ey
        contact = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])  # c = contact · (vx, vy, wz)
        rim = np.array([ax, ay]) @ contact / lever
        table[i, X], table[i, Y] = x, y
        table[i, RIM : RIM + 3] = rim
        table[i, ROLLER : ROLLER + 3] = np.array([px, py]) @ contact - rim * (px * ex + py * ey)
        table[i, DRAG : DRAG + 3] = px, py, x * py - y * px
        table[i, AXIS_LEVER], table[i, DRAG_LEVER] = lever, px * ex + py * ey
        resultant[:, i] = ax, ay, x * ay - y * ax
    # The body's lengths only scale the moment's row; the pseudo-inverse of a full-rank matrix with
    # independent rows is the least-norm distribution whatever that scale.
    table[:, FORCE : FORCE + 3] = np.linalg.pinv(resultant)
    plane = np.stack([np.ones(n), table[:, X], table[:, Y]])
    table[:, LOAD : LOAD + 3] = np.linalg.pinv(plane)
    if n == 4:
        null = np.linalg.svd(resultant)[2][-1]
        # A mode of one newton along each rim: the reference in which wheel fighting is quoted.
        null = null / np.abs(null * table[:, AXIS_LEVER]).max()
        table[:, NULL] = null * np.sign(null[0])
    return WheelLayout(table=np.ascontiguousarray(table), radius=radius)
