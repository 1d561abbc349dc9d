"""What the plugins of heights refuse: a refusal is a row, and all are one clear line."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from tests.support.directions import rough_patch
from tests.support.lanes import bitmap, refusal

#: 2.56 × 2.4 µm and gentle, so that nothing warns of it.
PATCH = rough_patch((30, 32), (0.08, 0.08), 0.03)
GREY = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
OXIDE = {"film_ior": 1.77, "film_thickness": 250.0}
THROUGH = {"plugin": "diffraction_dielectric"}
PLACED = {"coherence": "surface", "uv_scale": 10.0}
BOARD = {"type": "checkerboard"}
CHITIN = 'layers = [["chitin", 0.09], ["1.33", 0.08]]\nrepeat = 6\n'


def texels(*values: float, **more: Any) -> Callable[[], dict[str, Any]]:
    """A function that makes a bitmap of these numbers in the variant that is set."""
    return lambda: bitmap([values], **more)


REFUSED = [
    ({"foo": 1.0}, "unknown parameter 'foo'; Allowed: filename, data, pixel_size"),
    ({"coherence_widht": 60.0}, "unknown parameter 'coherence_widht'; did you mean coherence_wi"),
    ({"basis": "fourier"}, "basis='fourier' must be one of svd, chebyshev, taylor, auto"),
    ({"coherence_width": "wide"}, "coherence_width='wide' must be a positive number"),
    ({"tolerance": "fine"}, "tolerance='fine' must be between"),
    ({"wavelength": 900.0}, "wavelength=900 nm is outside the table's 360 to 830"),
    ({"terms": 8.5}, "terms=8.5 must be a whole number"),
    ({"terms": "eight"}, "terms='eight' must be a whole number"),
    ({"basis": "taylor", "terms": 3}, "terms=3 of basis='taylor' leave an error of"),
    ({"height_scale": 0.0}, "height_scale=0 must be above 0 and at most 1000"),
    ({"height_scale": math.nan}, "height_scale=nan must be a finite number"),
    ({"height_scale": math.inf}, "height_scale=inf must be a finite number"),
    ({"orientation": math.nan}, "orientation=nan must be a finite number"),
    ({"orientation": "left"}, "orientation='left' must be a number"),
    ({"energy_conserving": "maybe"}, "energy_conserving='maybe' must be true or false"),
    ({"int_ior": 0.5}, "int_ior=0.5 must be a refractive index of at least 1, or a name"),
    ({"int_ior": math.nan}, "int_ior=nan must be a refractive index of at least 1"),
    ({"int_ior": "custard"}, "int_ior='custard'"),
    ({"material": "Unobtainium"}, "material='Unobtainium' is unknown"),
    ({"material": "1.5x"}, "material='1.5x': an index is n + ik"),
    ({"material": 0.0}, "material=0.0: an index is n + ik"),
    ({"material": "AlSb"}, "302.4"),
    ({"material": "kerratin"}, "did you mean keratin?"),
    ({"int_ior": "melanin"}, "int_ior='melanin' absorbs light"),
    ({"material": "Al", "coat_ior": 1.4, "ext_ior": 1.33}, "leave ext_ior out"),
    ({"pigment": "custard"}, "pigment='custard' is not a colour"),
    ({"pigment": "0.2,1.5,0"}, "pigment='0.2,1.5,0' is not a colour"),
    ({"pigment": "nothing.csv"}, "nothing.csv"),
    ({"pigment": "red", "material": "gold"}, "pigment cannot be combined with a conductor"),
    ({"pigment": "red", "material": "1.5+0.1i"}, "pigment cannot be combined with a conductor"),
    ({"a": GREY, "b": GREY}, "2 nested BSDFs (a, b); at most one can lie beneath"),
    ({"beneath": GREY, "material": "none"}, "nested BSDF"),
    ({"beneath": GREY, "material": "Al"}, "nested BSDF"),
    ({"material": "Alu"}, "did you mean Al or Au?"),
    ({"material": "au"}, "did you mean Au"),
    ({"material": "Al", "int_ior": 1.5}, "material makes a conductor and int_ior a dielectric"),
    ({"material": "Al", "eta": 1.0, "k": 2.0}, "material and eta, k both define the conductor"),
    ({"eta": 1.0}, "eta alone is not a conductor; give both eta and k"),
    ({"k": 1.0}, "k alone is not a conductor; give both eta and k"),
    ({"max_height": 0.3}, "max_height is for files; the heights in data"),
    ({"pixel_size": 0.0}, "pixel_size: expected one length or a pair (dx, dy) in µm"),
    ({"pixel_size": "0.1, -0.1"}, "pixel_size: expected one length or a pair"),
    ({"pixel_size": math.nan}, "pixel_size: expected one length or a pair"),
    ({"filename": "a.exr"}, "give exactly one of filename, data; got filename and data"),
    # shadowing, orientation, model and indices
    ({"shadowing": "smith"}, "none, vcavity"),
    ({"orientation": GREY}, "cos, sin"),
    ({"model": "smallslope"}, "choose one of small_slope, kirchhoff"),
    ({"model": "small_slope", "material": "none"}, "material='none'"),
    ({"eta": 0.0, "k": 3.0}, "eta=0"),
    ({"eta": -1.0, "k": 3.0}, "eta=-1"),
    ({"eta": 1.0, "k": -3.0}, "k=-3"),
    ({"eta": math.nan, "k": 3.0}, "eta=nan"),
    ({"ext_ior": -1.5}, "ext_ior=-1.5"),
    # films and coats
    ({"film_ior": 1.4}, "film_ior alone is not a film"),
    ({"film_k": 0.1}, "film_k alone is not a film"),
    ({"film_ior": 1.4, "film_thickness": -5.0}, "film_thickness=-5 nm must be at least 0"),
    ({"film_ior": 1.4, "film_thickness": 1e4}, "over which light is coherent"),
    ({"film_ior": 0.5, "film_thickness": 100.0}, "film_ior=0.5"),
    (OXIDE | {"film_k": -0.1}, "film_k=-0.1 must be"),
    (OXIDE | {"film_thickness": BOARD}, "give film_thickness_max"),
    (OXIDE | {"film_thickness": BOARD, "film_thickness_max": -3.0}, "film_thickness_max=-3 nm"),
    (OXIDE | {"film_thickness": BOARD, "film_thickness_max": 1e4}, "over which light is coherent"),
    (OXIDE | {"film_thickness_max": 300.0}, "is for a film_thickness that is a texture"),
    (OXIDE | {"film_thickness": "thick"}, "must be a number"),
    (OXIDE | {"film_k": 3.0}, "absorbs all light"),
    (OXIDE | {"material": "none"}, "material='none'"),
    (OXIDE | {"coat_ior": 1.5}, "coat_ior"),
    (OXIDE | {"film_k": 0.1, "nested": {"type": "diffuse"}}, "film_k"),
    ({"coat_ior": 0.9}, "coat_ior=0.9"),
    ({"coat_ior": math.nan}, "coat_ior=nan"),
    ({"coat_ior": 1.2, "ext_ior": 1.33}, "below the index of the medium above"),
    ({"coat_ior": 1.5, "material": "none"}, "material='none'"),
    # light that goes through
    ({"transmission": True}, "'diffraction_dielectric'"),
    ({"thin": True}, "'diffraction_dielectric'"),
    (THROUGH | {"material": "Al"}, "'diffraction'"),
    (THROUGH | {"int_ior": 1.0, "ext_ior": 1.5}, "eta=0.666667"),
    (THROUGH | {"int_ior": 1.005, "ext_ior": 1.0}, "eta=1.005"),
    (THROUGH | {"pigment": {"type": "diffuse"}}, "light that goes through"),
    (THROUGH | {"coat_ior": 1.4}, "coat_ior"),
    (THROUGH | {"film_ior": 1.4, "film_thickness": 100.0}, "film_"),
    (THROUGH | {"shadowing": "vcavity"}, "shadowing"),
    (THROUGH | {"coherence": "surface"}, "coherence='surface'"),
    (THROUGH | {"thin": 1.0}, "thin=1.0"),
    (THROUGH | {"transmission": True}, "transmission"),
    # places
    ({"coherence": "surface"}, "takes one of uv_scale,"),
    (PLACED | {"world_scale": 1.0}, "got uv_scale and world_scale"),
    (PLACED | {"uv_scale": -1.0}, "uv_scale=-1.0 must be one number or two"),
    ({"world_scale": "10, 20"}, "world_scale='10, 20' must be one number"),
    (PLACED | {"uv_scale": "1, 2, 3"}, "must be one number or two"),
    (PLACED | {"uv_scale": 1e9}, "at most 1e+07"),
    ({"coherence": "surface", "world_scale": "10, 20"}, "must be one number of µm"),
    (PLACED | {"tiling": "hexagons"}, "choose one of periodic, random"),
    ({"coherence": "place"}, "choose one of ensemble, patch, surface"),
    # factors that vary; functions make a texture of the variant
    ({"lateral_scale": 0.0}, "lateral_scale=0 must be at least 0.01"),
    ({"lateral_scale": math.nan}, "lateral_scale=nan must be a finite number"),
    ({"lateral_scale": 200.0}, "at most 100"),
    ({"lateral_scale": texels(0.0, 0.7)}, "numbers go from 0 to 0.7"),
    ({"lateral_scale": texels(-1.3, -0.6)}, "largest factor, -0.6, must be at least"),
    ({"lateral_scale": texels(math.nan)}, "largest factor, nan, must be"),
    ({"lateral_scale": texels(1.0, raw=False)}, "the bitmap is not raw"),
    ({"lateral_scale": BOARD}, "needs lateral_scale_max"),
    ({"lateral_scale": BOARD | {"color0": 0.0}, "lateral_scale_max": 1.0}, "go from 0"),
    ({"lateral_scale": 1.2, "lateral_scale_max": 1.1}, "must be at least lateral_scale, 1.2"),
    ({"lateral_scale_max": 1.1}, "give both, or none"),
    ({"height_scale": 1.2, "height_scale_max": 2.0}, "for a height_scale that is a texture"),
    ({"height_scale": texels(-1.0, -0.0)}, "largest factor, -0, must be above 0"),
    ({"height_scale": texels(math.nan)}, "largest factor, nan, must be"),
    ({"height_scale": texels(-1.0, 0.25)}, "numbers go from -1 to 0.25"),
    ({"height_scale": texels(2e3)}, "must be"),
    ({"height_scale": texels(0.25, 1.25), "height_scale_max": 1.0}, "must be between 0 and 1"),
    ({"height_scale": texels(1.0, raw=False)}, "the bitmap is not raw"),
    ({"height_scale": BOARD}, "needs height_scale_max"),
    ({"height_scale": {"type": "mesh_attribute", "name": "vertex_worn"}}, "height_scale_max"),
    # layers, as text of their file
    ({"layers": "spread = 0.1"}, "layers: expected pairs"),
    ({"layers": 'layers = [["chitin", 0]]'}, "layer 1: thickness"),
    ({"layers": 'layers = [["chitim", 0.1]]'}, "did you mean chitin"),
    ({"layers": 'layers = [["none", 0.1]]'}, "perfect conductor is no layer"),
    ({"layers": 'layers = [["1.5", 0.1]]\nrepeet = 2'}, "unknown key 'repeet'"),
    ({"layers": 'layers = [["1.5", 0.1]]\nrepeat = 100'}, "interfere"),
    ({"layers": CHITIN, "coat_ior": 1.5}, "cannot be combined"),
    ({"layers": CHITIN, "film_ior": 1.5, "film_thickness": 100.0}, "cannot be combined"),
    ({"layers": CHITIN, "material": "none"}, "cannot be combined"),
    ({"layers": CHITIN, "model": "small_slope"}, "cannot be combined"),
    ({"layers": 'layers = [["melanin", 0.1]]', "pigment": 0.5}, "absorb the light"),
    # what transmits, beneath
    *(({"beneath": nested}, "lets light through") for nested in (
        {"type": "dielectric"}, {"type": "thindielectric"}, {"type": "roughdielectric"},
        {"type": "null"}, {"type": "mask", "opacity": 0.5, "b": GREY},
        {"type": "principled", "spec_trans": 0.5},
        {"type": "blendbsdf", "weight": 0.3, "a": GREY, "b": {"type": "null"}},
    )),
]  # fmt: skip


@pytest.mark.parametrize(("parameters", "said"), REFUSED, ids=[f"{n}" for n in range(len(REFUSED))])
def test_parameters_that_do_not_fit_are_one_clear_line(some_variant, tmp_path, parameters, said):
    given = {name: value() if callable(value) else value for name, value in parameters.items()}
    if "layers" in given:
        (tmp_path / "stack.toml").write_text(given["layers"])
        given["layers"] = str(tmp_path / "stack.toml")
    given = {"coherence_width": 2.4} | given
    assert said in refusal(lambda: mi.load_dict(md.bsdf_dict(PATCH, **given)))


def test_places_need_wavelengths():
    mi.set_variant("scalar_rgb")
    line = refusal(lambda: mi.load_dict(md.bsdf_dict(PATCH, **PLACED)))
    assert "coherence='surface'" in line
    assert "RGB" in line
