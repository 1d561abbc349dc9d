"""A plate's shader against the plugin: one direction of view, one of light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.realtime.glsl.context import VertexBuffer
from mitsuba_diffraction.realtime.glsl.renderer import Renderer
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.lanes import interaction, spectra, vectors

pytestmark = pytest.mark.thorough

#: Direction towards the eye in the plate's frame, and columns of a vertex that hold its colour.
VIEW = np.array([0.0, -0.6, 0.8])
COLOUR = slice(11, 14)


def test_what_lies_beneath_gets_the_light_that_the_table_leaves(
    gl: Any, table_file: Path, some_variant: str
) -> None:
    white = {"type": "diffuse", "reflectance": 1.0}
    skin = {"type": "diffraction", "filename": str(table_file), "int_ior": 2.5, "orientation": 25.0}
    plate = mi.load_dict({**skin, "nested": white})
    wo = np.array([-0.6, 0.64, 0.48])
    parameters = mi.traverse(plate)
    parameters["height_scale"] = 1.25
    parameters.update()
    drawn = pigment_of(gl, plate, wo)
    np.testing.assert_allclose(drawn, beneath(plate, wo), rtol=4e-4)  # half floats
    flat = np.prod([1.0 - reflectance(cos, 2.5 / 1.000277) for cos in (wo[2], VIEW[2])])
    assert np.abs(drawn / (wo[2] / np.pi * flat) - 1.0).min() > 4e-3


def pigment_of(gl: Any, plate: Any, wo: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a plate's shader adds for a white pigment beneath, over the light's irradiance."""
    scene, pictures = mi.load_dict(under_a_sun(plate, wo)), []
    for pigment in (1.0, 0.0):
        made = Renderer(scene, context=gl)
        vertices = made.scene.surfaces[0].vertices.copy()
        vertices[:, COLOUR] = pigment
        made.buffers[0].release()
        made.buffers[0] = VertexBuffer(gl, vertices)
        pictures.append(made.render("exact", supersampling=1)[1, 1, :3].astype(float))
        colour = made.lights[0].colour
        made.release()
    found = (pictures[0] - pictures[1]) / colour
    return np.asarray(found)


def under_a_sun(plate: Any, wo: NDArray[np.float64]) -> dict[str, Any]:
    """A plate seen along `VIEW`, lit along wo."""
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": 0.1,
            "to_world": mi.ScalarTransform4f().look_at(list(100.0 * VIEW), [0, 0, 0], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 4, "height": 4},
        },
        "plate": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(9), "bsdf": plate},
        "sun": {"type": "directional", "direction": (-wo).tolist(), "irradiance": 1.0},
    }


def beneath(plate: Any, wo: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same by the plugin, over all wavelengths of daylight."""
    lam = np.arange(380.0, 740.0, 5.0)
    si = interaction(np.broadcast_to(VIEW, (len(lam), 3)), lam)
    everywhere = vectors(np.broadcast_to(wo, (len(lam), 3)))
    of_nested = mi.BSDFContext()
    of_nested.component = 1
    found = spectra(plate.eval(of_nested, si, everywhere))[:, 0]
    weights = linear_srgb(response(lam))
    return np.asarray(found @ (weights / weights.sum(axis=0)))
