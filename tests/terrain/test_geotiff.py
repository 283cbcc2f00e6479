"""GeoTIFF: written by rasterio, read back; the wrong kinds refused with what mends them."""

from __future__ import annotations

import shutil
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from numpy.typing import NDArray
from rasterio.transform import Affine

from planner.errors import MapError
from planner.terrain.formats import load_terrain

# The south row comes last, as in every GeoTIFF.
NORTH_FIRST = np.arange(48, dtype=np.float32).reshape(6, 8)
# Cells of 30 m by 20 m; the north-west corner at (500000, 4000000).
PLACED = Affine(30.0, 0.0, 500_000.0, 0.0, -20.0, 4_000_000.0)


def write(
    path: Path,
    pixels: NDArray[Any] = NORTH_FIRST,
    *,
    transform: Affine = PLACED,
    crs: str | None = "EPSG:32613",
    unit: str | None = None,
    scale: float | None = None,
    **options: Any,
) -> Path:
    bands = pixels if pixels.ndim == 3 else pixels[None]
    with warnings.catch_warnings():
        # rasterio says of a file without georeference that it has none.
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.open(
            path,
            "w",
            driver="GTiff",
            height=bands.shape[1],
            width=bands.shape[2],
            count=bands.shape[0],
            dtype=bands.dtype,
            crs=crs,
            transform=transform,
            **options,
        ) as dataset:
            dataset.write(bands)
            if unit is not None:
                dataset.units = [unit]
            if scale is not None:
                dataset.scales, dataset.offsets = [scale], [1000.0]
    return path


def test_projected_geotiff_keeps_its_place_and_its_cells(tmp_path: Path) -> None:
    terrain = load_terrain(write(tmp_path / "dem.tif"))
    np.testing.assert_array_equal(terrain.heights, NORTH_FIRST[::-1])
    assert terrain.cell == (30.0, 20.0)
    assert terrain.extent == (500_000.0, 4_000_000.0 - 6 * 20.0, 500_240.0, 4_000_000.0)
    assert terrain.origin == (500_015.0, 3_999_890.0)
    assert terrain.crs == "EPSG:32613"
    assert terrain.known.all()


def test_rows_from_south_to_north_are_the_same_ground(tmp_path: Path) -> None:
    upright = load_terrain(write(tmp_path / "dem.tif"))
    flipped = Affine(30.0, 0.0, 500_000.0, 0.0, 20.0, 4_000_000.0 - 120.0)
    turned = load_terrain(write(tmp_path / "flip.tif", NORTH_FIRST[::-1], transform=flipped))
    assert turned.fingerprint == upright.fingerprint


@pytest.mark.parametrize("nodata", [5.0, np.nan, -3.4028234663852886e38])
def test_nodata_is_a_hole(tmp_path: Path, nodata: float) -> None:
    pixels = NORTH_FIRST.copy()
    pixels[0, 5] = nodata
    terrain = load_terrain(write(tmp_path / "dem.tif", pixels, nodata=nodata))
    assert not terrain.known[5, 5]
    assert terrain.known.sum() == 47
    assert np.abs(terrain.heights).max() < 50


def test_integers_with_a_scale_and_no_coordinate_system(tmp_path: Path) -> None:
    pixels = NORTH_FIRST.astype(np.int16)
    terrain = load_terrain(write(tmp_path / "dem.tif", pixels, scale=0.1, crs=None))
    np.testing.assert_allclose(terrain.heights, 1000 + 0.1 * NORTH_FIRST[::-1])
    assert terrain.crs is None


@pytest.mark.parametrize(
    ("options", "factor", "name"),
    [
        ({"unit": "ft"}, 0.3048, "ft"),
        ({"unit": "US survey foot"}, 1200 / 3937, "US survey foot"),
        # NAVD88 height in US survey feet over UTM zone 13.
        ({"crs": "EPSG:32613+6360"}, 1200 / 3937, "US survey foot"),
    ],
)
def test_heights_in_feet_are_converted_once_and_said(
    tmp_path: Path, options: dict[str, Any], factor: float, name: str
) -> None:
    terrain = load_terrain(write(tmp_path / "dem.tif", **options))
    np.testing.assert_allclose(
        terrain.heights, NORTH_FIRST[::-1].astype(float) * factor, rtol=1e-12
    )
    assert f"converted from {name} to metres" in terrain.source
    assert terrain.crs == "EPSG:32613"
    assert terrain.cell == (30.0, 20.0)


DEGREES = Affine(1 / 3600, 0.0, -105.0, 0.0, -1 / 3600, 40.0)
SOUTHERN = Affine(1 / 3600, 0.0, 151.0, 0.0, -1 / 3600, -33.0)

MERCATOR = Affine(30.0, 0.0, 946000.0, 0.0, -20.0, 5977000.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        # UTM zones by hand: floor((-105 + 180) / 6) + 1 = 13 north, floor((151 + 180) / 6) + 1
        # = 56 south.
        ({"crs": "EPSG:4326", "transform": DEGREES}, "gdalwarp -t_srs EPSG:32613"),
        ({"crs": "EPSG:4326", "transform": SOUTHERN}, "gdalwarp -t_srs EPSG:32756"),
        ({"crs": None, "transform": DEGREES}, "-s_srs EPSG:4326 -t_srs EPSG:32613"),
        ({"crs": "EPSG:2225"}, "x and y in US survey foot"),
        # Web Mercator stretches by 1/cos(latitude): cos(47.2°) = 0.68, but for the ellipsoid.
        ({"crs": "EPSG:3857", "transform": MERCATOR}, "0.68 m on the ground"),
        ({"transform": Affine(30.0, 5.0, 5e5, 5.0, -30.0, 4e6)}, "rotated or mirrored"),
        ({"transform": Affine(-30.0, 0.0, 5e5, 0.0, -30.0, 4e6)}, "rotated or mirrored"),
        ({"transform": Affine.identity(), "crs": None}, "cell size is unknown"),
        ({"pixels": np.zeros((3, 6, 8), np.uint8)}, "has 3 bands"),
        ({"pixels": NORTH_FIRST.astype(np.complex64)}, "complex"),
        ({"unit": "fathom"}, "unknown unit"),
        ({"pixels": np.where(NORTH_FIRST > 3, NORTH_FIRST, -9999)}, "gdal_edit.py -a_nodata -9999"),
        ({"pixels": 300_000.0 + 1000.0 * NORTH_FIRST}, "such as mm"),
        ({"nodata": 7.0, "pixels": np.full((6, 8), 7.0)}, "no known height"),
    ],
)
def test_unusable_geotiffs_are_refused_with_what_mends_them(
    tmp_path: Path, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(MapError) as caught:
        load_terrain(write(tmp_path / "dem.tif", **options))
    assert words in str(caught.value)
    assert "dem" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("crs", "x", "y"),
    [
        # Mercator's equator, and systems of a zone, a country and a continent.
        ("EPSG:3857", 1e6, 0.0),
        ("EPSG:32613", 3e5, 4.1e6),
        ("EPSG:2154", 7e5, 6.6e6),
        ("EPSG:3035", 4.3e6, 3.2e6),
        ("EPSG:5070", 0.0, 1.9e6),
    ],
)
def test_systems_with_metres_of_the_ground_are_read(
    tmp_path: Path, crs: str, x: float, y: float
) -> None:
    place = Affine(30.0, 0.0, x, 0.0, -20.0, y)
    assert load_terrain(write(tmp_path / "dem.tif", crs=crs, transform=place)).crs == crs


def test_header_that_claims_too_many_cells_is_refused_before_reading(tmp_path: Path) -> None:
    # A sparse file: 6.4 GB of heights in a few hundred kB.
    bomb = tmp_path / "bomb.tif"
    options: dict[str, Any] = {"driver": "GTiff", "dtype": "float32", "tiled": True}
    with rasterio.open(
        bomb,
        "w",
        width=40_000,
        height=40_000,
        count=1,
        crs="EPSG:32613",
        transform=PLACED,
        sparse_ok=True,
        **options,
    ):
        pass
    assert bomb.stat().st_size < 1_000_000
    begin = time.perf_counter()
    with pytest.raises(MapError, match="1,600,000,000 cells"):
        load_terrain(bomb)
    assert time.perf_counter() - begin < 1.0


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_cut_off_geotiff_is_refused(tmp_path: Path, share: float) -> None:
    pixels = np.random.default_rng(0).normal(size=(200, 300))
    whole = write(tmp_path / "whole.tif", pixels, compress="deflate", tiled=True).read_bytes()
    (tmp_path / "cut.tif").write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(MapError, match=r"cut\.tif cannot be read as a GeoTIFF"):
        load_terrain(tmp_path / "cut.tif")


def test_a_vrt_named_tif_cannot_reach_other_files(tmp_path: Path) -> None:
    write(tmp_path / "secret.tif")
    vrt = (
        '<VRTDataset rasterXSize="8" rasterYSize="6"><VRTRasterBand dataType="Float32" band="1">'
        "<SimpleSource><SourceFilename>secret.tif</SourceFilename></SimpleSource>"
        "</VRTRasterBand></VRTDataset>"
    )
    for text in (vrt, "\n " + vrt, '<?xml version="1.0"?>' + vrt):
        (tmp_path / "dem.tif").write_text(text)
        with pytest.raises(MapError, match=r"dem\.tif is named \.tif but is"):
            load_terrain(tmp_path / "dem.tif")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("photo.jpg", b"\xff\xd8\xff\xe0" + bytes(99), "is a JPEG picture, not a heightmap"),
        ("photo.tif", b"\xff\xd8\xff\xe0" + bytes(99), "named .tif but is a JPEG picture"),
        ("table.csv", b"x,y\n1,2\n", "has the ending '.csv'"),
        ("dem", b"1 2 3", "has the ending ''"),
        ("dem.tif", b"", "is empty"),
        ("dem.npz", b"hello", "named .npz but is something else"),
        ("dem.png", b"hello", "named .png but is something else"),
    ],
)
def test_maps_of_the_wrong_kind_are_named(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MapError) as caught:
        load_terrain(tmp_path / name)
    assert words in str(caught.value)
    assert "GeoTIFF (.tif)" in str(caught.value)


def test_folder_absent_file_and_geotiff_named_asc(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="is a folder"):
        load_terrain(tmp_path)
    with pytest.raises(MapError, match="does not exist"):
        load_terrain(tmp_path / "none.tif")
    shutil.copy(write(tmp_path / "dem.tif"), tmp_path / "dem.asc")
    with pytest.raises(MapError, match=r"named \.asc but is a TIFF"):
        load_terrain(tmp_path / "dem.asc")


def test_a_survey_of_1200_by_650_loads_in_under_a_second(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).normal(size=(650, 1200)).astype(np.float32)
    file = write(tmp_path / "dem.tif", pixels, compress="deflate", tiled=True, nodata=-9999)
    begin = time.perf_counter()
    terrain = load_terrain(file)
    assert time.perf_counter() - begin < 1.0
    assert terrain.heights.shape == (650, 1200)
