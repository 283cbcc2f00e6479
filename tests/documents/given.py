"""Files that the documents speak of as the reader's own: a log, a survey, a floor plan."""

from __future__ import annotations

import functools
import json
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from planner import PowerModel
from planner.power.vehicles import load_vehicle
from planner.telemetry.virtual import Noise, VirtualRobot

REQUEST = {"map": "test-bench", "start": {"x": 1.0, "y": 1.5}, "goal": {"x": 13.0, "y": 1.5}}
SURVEY_CORNER = (431000.0, 4070800.0)  # m, north-west, in UTM zone 14 north
FLOOR = (400, 200)  # pixels of the floor plan: 20 m by 10 m


@functools.cache
def _drive() -> Path:
    """A drive with hidden air drag, in the two formats of logs; one for the whole session."""
    folder = Path(tempfile.mkdtemp())
    robot = VirtualRobot("minibalance", hidden={"air_drag": {"size": 0.08}}, seed=3)
    drive = robot.drive("rich", noise=Noise(level=0.02)).split()[0]
    drive.write_csv(folder / "drive.csv")
    drive.write_parquet(folder / "long.parquet")
    return folder


def _copied(path: Path) -> None:
    path.write_bytes((_drive() / path.name).read_bytes())


def _columns(*names: str, every: int = 1) -> Callable[[Path], object]:
    """Columns of the drive's first run as a file of its own."""

    def write(path: Path) -> None:
        lines = [line.split(",") for line in (_drive() / "drive.csv").read_text().splitlines()]
        kept = [lines[0].index(name) for name in names]
        first = [line for line in lines[1:] if line[0] == lines[1][0]]
        rows = [lines[0], *first[::every]]
        path.write_text("".join(",".join(row[k] for k in kept) + "\n" for row in rows))

    return write


def _wheels(path: Path) -> None:
    """Wheel speeds of that run, rad/s."""
    _columns("time", "vx", "vy", "wz")(path)
    time, *body = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    wheels = load_vehicle("minibalance").layout
    speeds = [wheels.wheel_speeds(*velocity) for velocity in zip(*body, strict=True)]
    heading = "time," + ",".join(f"wheel_speed_{n}" for n in range(1, 5))
    table = np.column_stack([time, speeds])
    np.savetxt(path, table, delimiter=",", header=heading, comments="")


def _survey(path: Path) -> None:
    """Hills of 12 m over a square kilometre, in cells of 5 m."""
    import rasterio

    x, y = np.meshgrid(np.linspace(0.0, 9.0, 200), np.linspace(0.0, 9.0, 200))
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=200,
        height=200,
        count=1,
        dtype="float32",
        crs="EPSG:32614",
        transform=rasterio.Affine(5.0, 0.0, SURVEY_CORNER[0], 0.0, -5.0, SURVEY_CORNER[1]),
    ) as file:
        file.write((12.0 * np.sin(x) * np.sin(y)).astype(np.float32), 1)


def _heights(path: Path) -> None:
    """Heights of the floor plan's hall: level."""
    np.save(path, np.zeros((10, 20)))
    path.with_suffix(".toml").write_text(
        'cell = [1.0, 1.0]\norigin = [-10, -5]\nfirst_row = "south"'
    )


def _grey(values: NDArray[np.uint8]) -> Callable[[Path], object]:
    return lambda path: Image.fromarray(values).save(path)


def _floor() -> NDArray[np.uint8]:
    grey = np.full(FLOOR[::-1], 254, np.uint8)
    grey[:4] = grey[-4:] = grey[:, :4] = grey[:, -4:] = 0  # walls
    return grey


def _plan(path: Path) -> None:
    origin = "resolution: 0.05\norigin: [-10.0, -5.0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.196"
    path.write_text(f"image: floor.png\nnegate: 0\n{origin}\n")
    give(path.parent, "floor.png")


def _polygon(corners: list[list[float]], **properties: object) -> Callable[[Path], object]:
    document = {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [corners]},
    }
    return lambda path: path.write_text(json.dumps(document))


def _model(path: Path) -> None:
    vehicle = load_vehicle("minibalance")
    PowerModel.from_vehicle(vehicle, effects=vehicle.active).save(path)


GIVEN: dict[str, Callable[[Path], object]] = {
    "REQUEST.json": lambda path: path.write_text(json.dumps(REQUEST)),
    "request.json": lambda path: path.write_text(json.dumps(REQUEST)),
    "M.json": _model,
    "drive.csv": _copied,
    "long.parquet": _copied,
    "odom.csv": _columns("run", "time", "vx", "vy", "wz"),
    "power.csv": _columns("time", "power", every=4),
    "imu.csv": _columns("time", "roll", "pitch", "ax", "ay"),
    "wheels.csv": _wheels,
    "survey.tif": _survey,
    "heights.npy": _heights,
    "floor.yaml": _plan,
    "floor.png": _grey(_floor()),
    "elevation.png": _grey(np.tile(np.arange(1, 201, dtype=np.uint8), (100, 1))),
    "ramps.geojson": _polygon([[0, 0, 0], [4, 0, 0.4], [4, 2, 0.4], [0, 2, 0]]),
    "ground.geojson": _polygon([[5, 0], [8, 0], [8, 3], [5, 3]], ground="carpet"),
    "hill.asc": lambda path: path.write_text(
        "ncols 5\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 1\n" + "0 0 0 0 0\n" * 4
    ),
}


def give(folder: Path, text: str) -> None:
    """Write the files that a block names and that no earlier block wrote."""
    for name, write in GIVEN.items():
        path = folder / name
        if re.search(rf"(?<![\w/.-]){re.escape(name)}\b", text) and not path.exists():
            write(path)
