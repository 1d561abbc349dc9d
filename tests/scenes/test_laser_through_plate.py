"""A laser through a plate with a grating: orders on the wall where the grating equation says."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.scenes import SCENES

pytestmark = pytest.mark.thorough

PERIOD, WAVELENGTH = 1.0, 0.532  # µm
WALL, HEIGHT = 22.0, 9.0


@pytest.mark.parametrize(("incidence", "orders"), [(0.0, (-1, 0, 1)), (30.0, (-1, 0))])
@pytest.mark.usefixtures("some_variant")
def test_orders_fall_where_the_equation_says(incidence: float, orders: tuple[int, ...]) -> None:
    import drjit as dr
    import mitsuba as mi

    from mitsuba_diffraction.scene import load_scene

    given = {"incidence": f"{incidence}", "ambient": "1e-6"} | {
        "resx": "320", "resy": "150", "spp": "32", "shortest": "531.9", "longest": "532.1",
    }  # fmt: skip
    scene = load_scene(SCENES / "laser_through_plate.xml", given)
    picture = np.array(mi.render(scene, seed=1)).sum(axis=-1)
    rows, columns = np.indices(picture.shape) + 0.5
    turn = np.radians(incidence)
    across, normal = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    inside = np.arcsin(np.sin(turn) / 1.5)
    # where the beam, which comes along y, leaves the plate
    start = 0.4 * (np.tan(turn) - np.tan(inside)) * across
    for order in orders:
        x = np.sin(turn) + order * WAVELENGTH / PERIOD
        leaving = x * across + np.sqrt(1.0 - x * x) * normal
        place = start + leaving * (WALL - start[1]) / leaving[1]
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p = mi.Point3f(float(place[0]), WALL, HEIGHT)
        uv = scene.sensors()[0].sample_direction(si, mi.Point2f(0.5, 0.5))[0].uv
        here = np.ravel(np.array(uv))
        near = (abs(columns - here[0]) < 10) & (abs(rows - here[1]) < 6)
        brightest = np.argmax(np.where(near, picture, 0.0))
        found = np.array([columns.flat[brightest], rows.flat[brightest]])
        # the spot is 2 pixels wide; guided orders add weaker ones beside it
        np.testing.assert_allclose(found, here, atol=1.6)
        assert picture.flat[brightest] > 20 * np.median(picture[near])
