"""Draws the maps of fixed/ and the fractal ground; the same bytes on every machine.

    python -m maps.make_fixed_maps [FOLDER]        default: the folder fixed/ beside this file

writes NAME.asc (ESRI ASCII, heights in m) and, where a map has obstacles or several ground
classes, NAME.layers.toml, and prints the sha256 that belongs into catalogue.toml. A drawn map is
never edited: a new one gets a new name and a stated reason, because stored route energies refer to
it. `fractal_heights` is not written out (its text would take 1.5 MB) but computed when the map is
opened; its sha256 is taken over the heights in whole millimetres.

Frame of every map: local, x east, y north, m, (0, 0) at the outer south-west corner. The slopes are
chosen for a 12 kg Mecanum robot of 0.86 m x 0.52 m that climbs about 16 degrees forward.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Heights = NDArray[np.float64]

FRACTAL_CELLS = 512
"""Along each side."""
FRACTAL_CELL = 0.25
"""m."""
FRACTAL_SEED = 20210
"""Of the phases; any other gives relief of the same kind."""
# Root mean square of the slope's size: parts of the map are too steep for the robot, most is not.
FRACTAL_SLOPE = np.tan(np.radians(7.5))

# The bench: length of the slope from the paper, all else ours.
BENCH_SLOPE_LENGTH = 4.0
BENCH_ANGLE = np.radians(8.0)

DOCK_HEIGHT = 0.6
"""m."""
DOCK_WEST = 24.0
"""m, x of the dock's edge."""


def main(folder: Path) -> None:
    """Write all drawn maps into a folder and print their sha256."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, (heights, cell, decimals) in drawn_maps().items():
        text = esri_ascii(heights, cell=cell, decimals=decimals)
        layers = warehouse_layers() if name == "warehouse" else ""
        (folder / f"{name}.asc").write_bytes(text.encode("ascii"))
        if layers:
            (folder / f"{name}.layers.toml").write_bytes(layers.encode("ascii"))
        print(f"{name:14s} {hashlib.sha256((text + layers).encode('ascii')).hexdigest()}")
    millimetres = np.round(fractal_heights() * 1000).astype("<i4")
    print(f"{'fractal-512':14s} {hashlib.sha256(millimetres.tobytes()).hexdigest()}")


def drawn_maps() -> dict[str, tuple[Heights, float, int]]:
    """Name -> heights (south row first, m), cell size (m), decimals written."""
    return {
        # Planes need more than millimetres: 1 mm over a 0.1 m cell would be 0.6 degrees.
        "test-bench": (test_bench(), 0.1, 5),
        "tilted-plane": (tilted_plane(), 0.25, 5),
        "warehouse": (warehouse_heights(), 0.1, 5),
        "cone": (cone(), 0.25, 3),
        "saddle": (saddle(), 0.25, 3),
    }


def centres(nx: int, ny: int, cell: float) -> tuple[Heights, Heights]:
    """x and y of the cells' centres, (ny, nx) each."""
    x, y = np.meshgrid((np.arange(nx) + 0.5) * cell, (np.arange(ny) + 0.5) * cell)
    return x, y


def test_bench() -> Heights:
    """Flat, up, flat, down, flat along x, the same over the whole width; 14 m x 3 m.

    Slopes of 4 m along the ground at 8 degrees, 2 m of top, 2 m before and behind.
    """
    x, _ = centres(140, 30, 0.1)
    run = BENCH_SLOPE_LENGTH * np.cos(BENCH_ANGLE)
    top = BENCH_SLOPE_LENGTH * np.sin(BENCH_ANGLE)
    corners = [2.0, 2.0 + run, 4.0 + run, 4.0 + 2 * run]
    profile: Heights = np.interp(x, corners, [0.0, top, top, 0.0])
    return profile


def tilted_plane() -> Heights:
    """5 degrees, uphill at 30 degrees from +x; 24 m x 24 m."""
    x, y = centres(96, 96, 0.25)
    uphill = np.radians(30.0)
    plane: Heights = np.tan(np.radians(5.0)) * (x * np.cos(uphill) + y * np.sin(uphill))
    return plane


def cone() -> Heights:
    """A round hill at (20, 20), 3 m high, flanks of 12 degrees, top and foot rounded; 40 m."""
    x, y = centres(160, 160, 0.25)
    inward = 16.0 - np.sqrt((x - 20.0) ** 2 + (y - 20.0) ** 2 + 1.5**2)
    hill: Heights = np.tan(np.radians(12.0)) * 0.5 * (inward + np.sqrt(inward**2 + 1.0))
    return hill


def saddle() -> Heights:
    """Two hills at (20, 9) and (20, 31), joined by a ridge with a pass at (20, 20); 40 m.

    The ridge runs from border to border. Its flanks reach 30 degrees and more except at the pass,
    1.2 m high, where they stay below 11 degrees; the way over is some 4 m wide for the robot.
    """
    x, y = centres(160, 160, 0.25)
    from_pass = np.abs(y - 20.0)
    rise = _smooth_step(from_pass / 11.0)
    fall = _smooth_step((from_pass - 11.0) / 9.0)
    crest = 1.2 + 3.3 * rise - 0.7 * fall
    ridge: Heights = crest * np.exp(-((x - 20.0) ** 2) / (2 * 4.0**2))
    return ridge


def _smooth_step(t: Heights) -> Heights:
    t = np.clip(t, 0.0, 1.0)
    step: Heights = t * t * (3.0 - 2.0 * t)
    return step


def warehouse_heights() -> Heights:
    """A flat floor, a dock 0.6 m high east of x = 24 m, ramps of 5 and 8 degrees; 30 m x 20 m."""
    x, y = centres(300, 200, 0.1)
    z = np.where(x > DOCK_WEST, DOCK_HEIGHT, 0.0)
    for south, north, angle in ((2.0, 5.0, 5.0), (13.0, 16.0, 8.0)):
        ramp = np.clip(DOCK_HEIGHT - np.tan(np.radians(angle)) * (DOCK_WEST - x), 0.0, DOCK_HEIGHT)
        z = np.where((y > south) & (y < north), ramp, z)
    return z


def warehouse_layers() -> str:
    """Walls, shelves, kerbs, pallets, a carpet and a wet patch, one character a cell."""
    x, y = centres(300, 200, 0.1)
    drawn = np.full(x.shape, ".")

    def fill(character: str, west: float, east: float, south: float, north: float) -> None:
        drawn[(x > west) & (x < east) & (y > south) & (y < north)] = character

    fill("c", 17.0, 23.0, 6.5, 11.5)
    fill("~", 15.5, 18.5, 16.8, 19.0)
    for west, east, south, north in (
        # Outer walls, 0.2 m thick.
        (0.0, 30.0, 0.0, 0.2),
        (0.0, 30.0, 19.8, 20.0),
        (0.0, 0.2, 0.0, 20.0),
        (29.8, 30.0, 0.0, 20.0),
        # The wall between store and dock: a door from y = 17 to 19 and, through a thick pier, a
        # passage 0.7 m wide and 1.5 m long from y = 9.1 to 9.8: the robot fits lengthwise only.
        (15.0, 15.2, 0.0, 17.0),
        (15.0, 15.2, 19.0, 20.0),
        (14.0, 15.5, 8.1, 9.1),
        (14.0, 15.5, 9.8, 10.8),
        # Kerbs along both sides of the ramps.
        (17.1, 24.0, 1.9, 2.0),
        (17.1, 24.0, 5.0, 5.1),
        (19.7, 24.0, 12.9, 13.0),
        (19.7, 24.0, 16.0, 16.1),
        # Pallets on the dock.
        (26.0, 27.2, 6.0, 7.0),
        (26.0, 27.2, 12.0, 13.0),
    ):
        fill("#", west, east, south, north)
    fill(".", 15.0, 15.2, 9.1, 9.8)
    # Shelves 1.0 m deep with aisles of 1.6 m between them.
    for south in (2.0, 4.6, 7.2, 9.8, 12.4, 15.0):
        fill("#", 3.0, 12.0, south, south + 1.0)
    rows = "\n".join(f'  "{"".join(row)}",' for row in drawn[::-1])
    return (
        "# Drawn by maps/make_fixed_maps.py; north row first, one character a cell of 0.1 m.\n"
        f"rows = [\n{rows}\n]\n\n"
        '[legend]\n"#" = "obstacle"\n"." = "concrete"\n"c" = "carpet"\n"~" = "wet"\n\n'
        "[ground.concrete]\nrolling = 1.0\ntraction = 1.0\n\n"
        "[ground.carpet]\nrolling = 2.3\ntraction = 0.9\n\n"
        "[ground.wet]\nrolling = 1.0\ntraction = 0.5\n"
    )


def fractal_heights() -> Heights:
    """A fractal ground of 512 x 512 cells of 0.25 m, heights in whole millimetres, m.

    Random phases under an amplitude that falls with the square of the wave number (a self-affine
    surface of Hurst exponent 1), waves below 2 m damped, scaled to the slope above. The phases come
    from the raw 64-bit numbers of PCG64, which NumPy guarantees; rounding to 1 mm lies eleven
    orders above the rounding in which two machines' transforms may differ.
    """
    n = FRACTAL_CELLS
    raw = np.random.PCG64(FRACTAL_SEED).random_raw(n * (n // 2 + 1))
    phase = (raw >> np.uint64(11)).astype(np.float64) * (2 * np.pi / 2**53)
    wave_x = np.fft.rfftfreq(n, FRACTAL_CELL)
    wave_y = np.fft.fftfreq(n, FRACTAL_CELL)[:, None]
    wave = np.sqrt(wave_x**2 + wave_y**2)
    wave[0, 0] = np.inf
    amplitude = np.exp(-((wave * 2.0) ** 2)) / wave**2
    amplitude[0, 0] = 0.0
    spectrum = amplitude * np.exp(1j * phase.reshape(n, n // 2 + 1))
    z = np.fft.irfft2(spectrum, s=(n, n))
    slope_x, slope_y = np.diff(z, axis=1) / FRACTAL_CELL, np.diff(z, axis=0) / FRACTAL_CELL
    z *= FRACTAL_SLOPE / np.sqrt((slope_x**2).mean() + (slope_y**2).mean())
    rounded: Heights = np.round((z - z.min()) * 1000) / 1000
    return rounded


def esri_ascii(heights: Heights, *, cell: float, decimals: int) -> str:
    """An ESRI ASCII grid with its outer south-west corner at (0, 0)."""
    ny, nx = heights.shape
    lines = [f"ncols {nx}", f"nrows {ny}", "xllcorner 0", "yllcorner 0", f"cellsize {cell:g}"]
    for row in heights[::-1]:
        lines.append(" ".join(_shortest(value, decimals) for value in row))
    return "\n".join(lines) + "\n"


def _shortest(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "fixed")
