"""Orders on a wall: where the grating equation says, and as bright as another program lists."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.scenes import SCENES

PERIOD, WAVELENGTH, INCIDENCE, TILT = 1.6, 0.6, 10.0, 5.0  # µm and degrees
#: Efficiencies of orders of the only light in the file, whatever their wavelength.
EFFICIENCIES = {-2: 0.05, -1: 0.1, 0: 0.3, 1: 0.25, 2: 0.15, 3: 0.05}
#: Orders that the wall catches.
SEEN = (-1, 0, 1, 2)
WALL, HEIGHT = 22.0, 9.0  # cm: the wall's distance, and how high the light meets it


@pytest.fixture
def table(tmp_path: Path) -> Path:
    rows = [
        f"{wavelength},{INCIDENCE},0,{order},{efficiency},{efficiency}"
        for wavelength in (590, 610)
        for order, efficiency in EFFICIENCIES.items()
    ]
    file = tmp_path / "bench.csv"
    file.write_text("\n".join(["wavelength_nm,theta_deg,phi_deg,order,R_s,R_p", *rows]))
    with pytest.warns(md.DiffractionWarning, match="no light from some directions"):
        md.read_orders(file, PERIOD).save(tmp_path / "bench.nc")
    return tmp_path / "bench.nc"


def turned(angle: float, axis: int) -> np.ndarray:
    """Rotation around an axis of the world, by degrees."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    rows = {0: [[1, 0, 0], [0, c, -s], [0, s, c]], 2: [[c, -s, 0], [s, c, 0], [0, 0, 1]]}
    return np.array(rows[axis])


def place_on_wall(order: int) -> np.ndarray:
    """Point of the wall, at y = 22, that an order hits, by the grating equation."""
    to_world = turned(INCIDENCE, 2) @ turned(TILT, 0) @ turned(-90.0, 0)
    light = to_world.T @ [0.0, 1.0, 0.0]
    x, y = order * WAVELENGTH / PERIOD - light[0], -light[1]
    leaving = to_world @ [x, y, np.sqrt(1.0 - x * x - y * y)]
    return np.asarray([0.0, 0.0, HEIGHT] + leaving * WALL / leaving[1])


def on_film(sensor: object, points: np.ndarray) -> np.ndarray:
    """Pixel coordinates (n, 2) of points (n, 3)."""
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p = mi.Point3f(points.T)
    sample, _ = sensor.sample_direction(si, mi.Point2f(0.5, 0.5))  # type: ignore[attr-defined]
    return np.array(sample.uv).reshape(2, -1).T


@pytest.mark.usefixtures("some_variant")
def test_orders_fall_where_the_equation_says_and_are_as_bright_as_listed(table: Path) -> None:
    import mitsuba as mi

    from mitsuba_diffraction.scene import load_scene

    parameters = {
        "material:rulings": str(table), "incidence": str(INCIDENCE), "tilt": str(TILT),
        "shortest": "599.9", "longest": "600.1", "ambient": "1e-6",
        "resx": "320", "resy": "150", "spp": "16",
    }  # fmt: skip
    scene = load_scene(SCENES / "orders_on_wall.xml", parameters)
    picture = np.array(mi.render(scene, seed=1)).sum(axis=-1)
    rows, columns = np.indices(picture.shape) + 0.5
    power = {}
    for order in SEEN:
        centre = place_on_wall(order)
        step = 0.01 * np.eye(3)
        here, right, up = on_film(scene.sensors()[0], np.array([centre, *centre + step[[0, 2]]]))
        near = (abs(columns - here[0]) < 12) & (abs(rows - here[1]) < 10)
        light = picture * near
        centroid = np.array([(columns * light).sum(), (rows * light).sum()]) / light.sum()
        # noise of a centroid is about 0.03 pixels; one degree is 1.7 pixels or more
        np.testing.assert_allclose(centroid, here, atol=0.1)
        pixels = abs(np.linalg.det(np.array([right - here, up - here]))) / 0.01**2  # per cm²
        power[order] = light.sum() / pixels
    for order in SEEN:
        # noise of a spot is about 1 %
        ratio = EFFICIENCIES[order] / EFFICIENCIES[0]
        assert power[order] / power[0] == pytest.approx(ratio, rel=0.04)


@pytest.mark.thorough
@pytest.mark.parametrize(("incidence", "orders"), [(0.0, (-1, 0, 1)), (30.0, (-1, 0))])
@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
@pytest.mark.usefixtures("some_variant")
def test_a_laser_through_a_plate_has_its_orders(incidence: float, orders: tuple[int, ...]) -> None:
    import mitsuba as mi

    from mitsuba_diffraction.scene import load_scene

    given = {"incidence": f"{incidence}", "ambient": "1e-6"} | {
        "resx": "320", "resy": "150", "spp": "32", "shortest": "531.9", "longest": "532.1",
    }  # fmt: skip
    scene = load_scene(SCENES / "laser_through_plate.xml", given)
    picture = np.array(mi.render(scene, seed=1)).sum(axis=-1)
    rows, columns = np.indices(picture.shape) + 0.5
    turn, period, wavelength = np.radians(incidence), 1.0, 0.532
    across, normal = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    inside = np.arcsin(np.sin(turn) / 1.5)
    # where the beam, which comes along y, leaves the plate
    start = 0.4 * (np.tan(turn) - np.tan(inside)) * across
    for order in orders:
        x = np.sin(turn) + order * wavelength / period
        leaving = x * across + np.sqrt(1.0 - x * x) * normal
        place = start + leaving * (WALL - start[1]) / leaving[1]
        (here,) = on_film(scene.sensors()[0], np.array([[place[0], WALL, HEIGHT]]))
        near = (abs(columns - here[0]) < 10) & (abs(rows - here[1]) < 6)
        brightest = np.argmax(np.where(near, picture, 0.0))
        found = np.array([columns.flat[brightest], rows.flat[brightest]])
        # the spot is 2 pixels wide; guided orders add weaker ones beside it
        np.testing.assert_allclose(found, here, atol=1.6)
        assert picture.flat[brightest] > 20 * np.median(picture[near])
