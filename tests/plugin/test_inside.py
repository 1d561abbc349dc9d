"""Inside other plugins and functions of `dr.freeze`: wrapped, tilted, instanced, several."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import as_single, polar
from tests.support.lanes import bitmap, evaluated, interaction, spectra, vectors
from tests.support.plates import (
    OTHER,
    WAVELENGTHS,
    diffraction,
    grey,
    pairs,
    plate,
    rendered,
    scene,
)
from tests.support.variants import use

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("theta", [0.0, 20.0])
def test_on_a_tilted_frame_it_sees_tilted_directions(variant, theta):
    """A map that tilts the frame towards +x by θ everywhere turns the directions back by θ."""

    def tilt(nested: dict[str, Any]) -> Any:
        normals = bitmap(np.tile(0.5 + 0.5 * polar(theta), (2, 2, 1)))
        return mi.load_dict({"type": "normalmap", "nested": nested, "normalmap": normals})

    tilted, tilted_white = tilt(diffraction()), tilt(grey(1.0))
    wi, wo = pairs()
    angle = np.radians(theta)
    back = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    turned_i, turned_o = as_single(wi @ back.T), as_single(wo @ back.T)
    above = (turned_i[:, 2] > 0.05) & (turned_o[:, 2] > 0.05)
    wi, wo, turned_i, turned_o = (d[above] for d in (wi, wo, turned_i, turned_o))
    si = interaction(wi, WAVELENGTHS)
    si.uv = mi.Point2f(0.5, 0.5)
    si.n = mi.Normal3f(0, 0, 1)
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    value, white = (
        spectra(b.eval(mi.BSDFContext(), si, vectors(wo))) for b in (tilted, tilted_white)
    )
    # the map darkens what the true surface would hide, whatever it holds: by as much as white
    darkened = white / (turned_o[:, 2:] / np.pi)
    assert np.all((darkened > 0.5) & (darkened < 1.0 + 1e-5))
    expected = evaluated(mi.load_dict(diffraction()), turned_i, turned_o, WAVELENGTHS) * darkened
    # slopes in single precision, against lobes 40 mrad wide
    assert np.sum(np.abs(value - expected)) < 1e-4 * np.sum(expected)


def test_each_of_several_surfaces_keeps_its_own_patch(variant):
    bsdfs = [
        diffraction(),
        diffraction(OTHER, material="Au", orientation=40.0),
    ]
    places = (-0.8, 0.8)
    together = scene(*(plate(b, x) for b, x in zip(bsdfs, places, strict=True)), size=24)
    alone = [scene(plate(b, x), size=24) for b, x in zip(bsdfs, places, strict=True)]
    whole, parts = rendered(together), [rendered(s) for s in alone]
    # the left plate's half of the picture, and the right one's; nothing lies on the other side
    expected = np.concatenate([parts[0][:, :12], parts[1][:, 12:]], axis=1)
    assert np.abs(parts[0] - parts[1]).max() > 0.1 * whole.max()
    assert whole == pytest.approx(expected, rel=1e-3, abs=1e-4 * whole.max())  # single precision


@pytest.mark.parametrize("name", ["llvm_ad_rgb", "llvm_ad_mono", "cuda_ad_rgb"])
def test_frozen_rendering_follows_its_parameters(name):
    use(name)
    conserving = {"energy_conserving": True, "wavelength": 600.0}
    index = {"material": None, "int_ior": 1.5}
    surfaces = [
        diffraction(lateral_scale=1.0, **conserving),
        diffraction(OTHER, **conserving),  # the same arrays, other numbers
        diffraction(**index),  # into total reflection
        diffraction(pigment=grey(0.4), **index, **conserving),
    ]
    if name != "cuda_ad_rgb":  # Dr.Jit 1.5 ends the process when it records samples of a bitmap
        tilted = bitmap(np.full((2, 2, 3), 0.61))
        surfaces.append(diffraction(OTHER, coherence="patch", orientation=tilted))
    changes = {
        "height_scale": (1.0, 0.9, 0.92), "orientation": (0.0, 20.0, 90.0),
        "lateral_scale": (1.0, 0.9, 0.8), "eta": (1.5, 1.3, 0.7),
    }  # fmt: skip
    frozen = dr.freeze(lambda scene, seed: mi.render(scene, spp=16, seed=seed))
    for surface in surfaces:
        one = scene(plate(surface))
        parameters = mi.traverse(one)
        keys = {key.rsplit(".", 1)[-1]: key for key in dict(parameters)}
        for n in range(3):
            for parameter in changes.keys() & keys.keys():
                parameters[keys[parameter]] = changes[parameter][n]
            parameters.update()
            expected = rendered(one, 16)
            found = np.array(frozen(one, mi.UInt32(0)), float)
            assert found == pytest.approx(expected, rel=1e-4, abs=1e-5 * expected.max())
    # a recording a scene, and one more where a first value was a literal still
    assert frozen.n_recordings <= 2 * len(surfaces)
