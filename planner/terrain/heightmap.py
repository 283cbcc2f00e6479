"""The ground: heights on a grid, with a gradient that is exactly their derivative.

Row 0 of every array is the SOUTH row; x grows with the column, y with the row. Node [j, i] is the
centre of a cell, at x = x0 + i dx, y = y0 + j dy; dx and dy may differ. The map covers the nodes
and half a cell around them.

Between nodes the height is a cubic convolution and the gradient its exact derivative
(interpolation.py). Holes carry the nearest known height, only so that the interpolation beside
them meets a number; `known` says that nobody may ride there.

A cell is blocked when something stands on it, when its height is unknown, or when it is one side
of a ledge: a step between 4-neighbours higher than the robot can ride over and steeper than 45
degrees (|dz| > step_height and |dz| > distance). obstacles.py says where a body fits among them.

Left out: overhangs.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner.terrain.grid_checks import require
from planner.terrain.interpolation import interpolate_many
from planner.terrain.surface import PLAIN_GROUND, GroundClass, footprint_heights

# The cubic needs four nodes in each axis.
SMALLEST_SIDE = 4


@dataclass(frozen=True, eq=False)
class Terrain:
    """A map: heights, holes, obstacles and ground classes on one grid.

    Make one with `Terrain.from_arrays`, which checks and fills. The arrays are shared, not copied:
    treat them as read-only.

    Attributes:
        name: what the map is called.
        heights: (ny, nx) m; holes carry the nearest known height, so no NaN is ever met.
        known: (ny, nx) False = hole, nobody measured there; unknown is not ground.
        obstacles: (ny, nx) True = something stands there.
        ground: (ny, nx) index into ground_classes.
        ground_classes: the kinds of ground, at least one.
        origin: x, y of node [0, 0], m, in the map's frame.
        cell: dx, dy, m.
        crs: coordinate reference system, "EPSG:32613"; None = a local frame.
        source: where it came from, and what was converted on reading.
        odd: what its files probably do not mean, in sentences.
    """

    name: str
    heights: NDArray[np.float64]
    known: NDArray[np.bool_]
    obstacles: NDArray[np.bool_]
    ground: NDArray[np.uint8]
    ground_classes: tuple[GroundClass, ...]
    origin: tuple[float, float]
    cell: tuple[float, float]
    crs: str | None
    source: str
    odd: tuple[str, ...] = ()

    @classmethod
    def from_arrays(
        cls,
        heights: ArrayLike,
        *,
        cell: tuple[float, float],
        origin: tuple[float, float] = (0.0, 0.0),
        name: str = "terrain",
        known: ArrayLike | None = None,
        obstacles: ArrayLike | None = None,
        ground: ArrayLike | None = None,
        ground_classes: tuple[GroundClass, ...] = PLAIN_GROUND,
        crs: str | None = None,
        source: str = "arrays",
        odd: tuple[str, ...] = (),
    ) -> Terrain:
        """A checked terrain from arrays; NaN heights and `known` = False are holes.

        Args:
            heights: (ny, nx) m, row 0 the south row, at least 4 by 4.
            cell: dx, dy, m, both above 0.
            origin: x, y of node [0, 0], m.
            name: what the map is called.
            known: (ny, nx) bool; everywhere by default.
            obstacles: (ny, nx) bool; nowhere by default.
            ground: (ny, nx) index into ground_classes; 0 by default.
            ground_classes: the kinds of ground.
            crs: coordinate reference system or None.
            source: where the arrays came from.
            odd: what they probably do not mean, in sentences.

        Raises:
            MapError: a shape, cell size, index or height cannot be used, or nothing is known.
        """
        z = np.array(heights, dtype=np.float64, order="C")
        _check_grid(name, z, cell, origin)
        shape = z.shape
        is_known = np.isfinite(z) & _layer(name, "known", known, shape, fill=1).astype(np.bool_)
        some = "a grid with at least one height that is neither nodata nor NaN"
        require(name, bool(is_known.any()), "holds no known height", some)
        stands = _layer(name, "obstacles", obstacles, shape).astype(np.bool_)
        kinds = _layer(name, "ground", ground, shape).astype(np.uint8)
        _check_ground(name, kinds, ground_classes)
        if not is_known.all():
            # Only so that the interpolation beside a hole meets a number; nobody rides over it.
            from scipy.ndimage import distance_transform_edt

            rows, columns = distance_transform_edt(
                ~is_known, sampling=(cell[1], cell[0]), return_distances=False, return_indices=True
            )
            z = z[rows, columns]
        return cls(
            name=name,
            heights=z,
            known=is_known,
            obstacles=stands,
            ground=kinds,
            ground_classes=tuple(ground_classes),
            origin=(float(origin[0]), float(origin[1])),
            cell=(float(cell[0]), float(cell[1])),
            crs=crs,
            source=source,
            odd=odd,
        )

    @cached_property
    def fingerprint(self) -> str:
        """sha256 over arrays, geometry, ground classes and what is odd; not over name or source."""
        digest = hashlib.sha256()
        digest.update(
            repr((self.heights.shape, self.origin, self.cell, self.crs, *self.odd)).encode()
        )
        digest.update(repr(self.ground_classes).encode())
        for layer in (self.heights, self.known, self.obstacles, self.ground):
            digest.update(np.ascontiguousarray(layer).tobytes())
        return digest.hexdigest()

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """xmin, ymin, xmax, ymax of the cells' outer edges, m."""
        (x0, y0), (dx, dy) = self.origin, self.cell
        ny, nx = self.heights.shape
        return x0 - dx / 2, y0 - dy / 2, x0 + (nx - 0.5) * dx, y0 + (ny - 0.5) * dy

    def contains(self, x: float, y: float) -> bool:
        """Whether the point lies on the map, its outer edge included."""
        xmin, ymin, xmax, ymax = self.extent
        return bool(xmin <= x <= xmax and ymin <= y <= ymax)

    def cell_index(self, x: float, y: float) -> tuple[int, int]:
        """Row j and column i of the cell that holds a point; beyond the map as if it went on."""
        i = math.floor((x - self.origin[0]) / self.cell[0] + 0.5)
        j = math.floor((y - self.origin[1]) / self.cell[1] + 0.5)
        return j, i

    def cells_in(self, rings: Sequence[Any], *, touched: bool = False) -> NDArray[np.bool_]:
        """(ny, nx) cells whose centres lie in a polygon, or all that it touches.

        Args:
            rings: corners (x, y) in m, of the outline and of holes in it.
            touched: whether a cell counts whose centre lies outside.
        """
        from rasterio import Affine
        from rasterio.features import geometry_mask

        (west, _, _, north), (dx, dy) = self.extent, self.cell
        inside: NDArray[np.bool_] = geometry_mask(
            [{"type": "Polygon", "coordinates": rings}],
            out_shape=self.heights.shape,
            transform=Affine(dx, 0.0, west, 0.0, -dy, north),
            all_touched=touched,
            invert=True,
        )
        return inside[::-1]

    def height(self, x: ArrayLike, y: ArrayLike) -> Any:
        """Height at x, y (m, broadcast together), m; a number for two numbers."""
        return self._sample(x, y)[0][()]

    def gradient(self, x: ArrayLike, y: ArrayLike) -> tuple[Any, Any]:
        """dz/dx and dz/dy at x, y (m, broadcast together): the exact derivative of `height`."""
        _, gx, gy = self._sample(x, y)
        return gx[()], gy[()]

    def riding_surface(self, half_length: float) -> NDArray[np.float64]:
        """Heights as a footprint of half length `half_length` (m) feels them; (ny, nx) m.

        The gradient of this surface is what the robot climbs; see surface.py.
        """
        return footprint_heights(self.heights, half_length=half_length, cell=self.cell)

    def blocked_cells(self, step_height: float) -> NDArray[np.bool_]:
        """Cells that a body must not cover.

        Args:
            step_height: highest step that the robot rides over, m.

        Returns:
            (ny, nx) bool, True = obstacle, hole or side of a ledge.
        """
        return self.obstacles | ~self.known | self._ledges(step_height)

    def why_blocked(self, step_height: float, j: int, i: int) -> str | None:
        """What blocks cell [j, i], or None when nothing does.

        Returns:
            "edge of the map" (the index lies beyond it), "obstacle", "hole", "ledge" or None.
        """
        ny, nx = self.heights.shape
        if not (0 <= j < ny and 0 <= i < nx):
            return "edge of the map"
        if self.obstacles[j, i]:
            return "obstacle"
        if not self.known[j, i]:
            return "hole"
        return "ledge" if self._ledges(step_height)[j, i] else None

    def _ledges(self, step_height: float) -> NDArray[np.bool_]:
        ledge = np.zeros(self.heights.shape, dtype=np.bool_)
        # Along x, then along y of the transposed arrays, which are views.
        for z, known, found, cell in (
            (self.heights, self.known, ledge, self.cell[0]),
            (self.heights.T, self.known.T, ledge.T, self.cell[1]),
        ):
            step = np.abs(np.diff(z, axis=1))
            # Steps to and from a hole are steps of the filling, not of the ground.
            side = (step > max(step_height, cell)) & known[:, 1:] & known[:, :-1]
            found[:, 1:] |= side
            found[:, :-1] |= side
        return ledge

    def _sample(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        xs, ys = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        flat_x, flat_y = np.array(xs, order="C").ravel(), np.array(ys, order="C").ravel()
        values: NDArray[np.float64] = interpolate_many(
            self.heights, *self.origin, *self.cell, flat_x, flat_y
        )
        return values.reshape(3, *xs.shape)


def _check_grid(
    name: str, z: NDArray[np.float64], cell: tuple[float, float], origin: tuple[float, float]
) -> None:
    require(
        name,
        z.ndim == 2 and min(z.shape) >= SMALLEST_SIDE,
        f"has heights of shape {z.shape}",
        f"two dimensions, at least {SMALLEST_SIDE} by {SMALLEST_SIDE} cells",
    )
    lengths = np.size(cell) == 2 and all(math.isfinite(d) and d > 0 for d in cell)
    above = "dx, dy in metres, both above 0"
    require(name, lengths, "has a cell size that is not a length", above, value=cell)
    point = len(origin) == 2 and all(math.isfinite(c) for c in origin)
    centre = "x, y of the south-west cell's centre in metres, both finite"
    require(name, point, "has an origin that is not a point", centre, value=origin)


def _layer(
    name: str, what: str, values: ArrayLike | None, shape: tuple[int, ...], fill: int = 0
) -> NDArray[Any]:
    layer = np.full(shape, fill, np.uint8) if values is None else np.asarray(values)
    given = f"has a layer '{what}' of shape {layer.shape}"
    require(name, layer.shape == shape, given, f"the shape of its heights, {shape}")
    require(
        name,
        layer.dtype.kind in "biu" and layer.min() >= 0 and layer.max() <= 255,
        f"has a layer '{what}' that is not made of whole numbers from 0 to 255",
        "true or false, for ground the index of a ground class",
    )
    return layer


def _check_ground(
    name: str, ground: NDArray[np.uint8], ground_classes: tuple[GroundClass, ...]
) -> None:
    count = len(ground_classes)
    require(
        name,
        ground.max() < count,
        f"names ground class {ground.max()}",
        f"indices below {count}, the number of ground classes given",
    )
    for kind in ground_classes:
        require(
            name,
            0 <= kind.rolling < math.inf and 0 < kind.traction < math.inf,
            "has a ground class with an impossible factor",
            "rolling 0 or more, traction above 0, both finite",
            value=kind,
        )
