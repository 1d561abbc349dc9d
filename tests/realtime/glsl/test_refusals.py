"""What the realtime renderer refuses, in one line that says what is wrong. A refusal is one row."""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
import mitsuba_diffraction.thesis.shaders  # registers its methods
from mitsuba_diffraction.realtime.glsl.context import check_version, headless_context
from mitsuba_diffraction.realtime.glsl.diffracting import pack_table
from mitsuba_diffraction.realtime.glsl.emitters import Emitters
from mitsuba_diffraction.realtime.glsl.export import make_shader
from mitsuba_diffraction.realtime.glsl.packing import pack_powers
from mitsuba_diffraction.realtime.glsl.renderer import Renderer
from mitsuba_diffraction.realtime.glsl.scene import read_scene
from mitsuba_diffraction.realtime.glsl.source import fragment_parts
from mitsuba_diffraction.realtime.web.export import make_page
from tests.support.orders import load, thin_grating
from tests.support.refusals import refused

GRATING = md.gratings.sinusoidal(1.6, 0.05, periods=2)
TURN = {"type": "mesh_attribute", "name": "vertex_orientation"}
PLACED = {"coherence": "surface", "uv_scale": 10.0, "coherence_width": 2.4}


def scene_of(sensor: str = "perspective", **parts: Any) -> mi.Scene:
    return mi.load_dict({"type": "scene", "sensor": {"type": sensor}, **parts})


def skinned(kind: str, **given: Any) -> dict[str, Any]:
    """A shape that diffracts."""
    return {"type": kind, "bsdf": md.bsdf_dict(GRATING, **{"coherence_width": 2.4} | given)}


def plate(bsdf: Any) -> mi.Scene:
    """A mesh of one triangle, without attributes and texture coordinates."""
    props = mi.Properties()
    props["bsdf"] = mi.load_dict(bsdf)
    return scene_of(shape=mi.Mesh("plate", 3, 1, props=props))


def lit(**parts: Any) -> Emitters:
    return Emitters(mi.load_dict({"type": "scene", **parts}), np.zeros(3))


def sky() -> dict[str, Any]:
    picture = np.ones((8, 16, 3), np.float32)
    picture[2, 3] = np.inf
    return {"type": "envmap", "bitmap": mi.Bitmap(picture)}


def shader(methods: list[str], **given: Any) -> object:
    return make_shader(mi.load_dict(skinned("disk", **given)["bsdf"]), methods)


def driver(version: int, most: int) -> None:
    info = {"GL_RENDERER": "Ancient", "GL_MAX_TEXTURE_SIZE": most}
    check_version(types.SimpleNamespace(version_code=version, info=info))


def missing_driver() -> None:
    def fail(**_: object) -> None:
        raise Exception("libEGL.so not\nfound")

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(pytest.importorskip("moderngl"), "create_standalone_context", fail)
        headless_context()


#: What is asked for with a context, and words of the line.
REFUSED: list[tuple[Callable[[Any], object], str]] = [
    # scenes
    (lambda gl: Renderer(scene_of(shape={"type": "sphere"}), context=gl), "no supported shape"),
    (lambda gl: Renderer(scene_of("orthographic", shape=skinned("rectangle")), context=gl),
     "OrthographicCamera.*perspective"),
    (lambda gl: Renderer(plate(skinned("disk")["bsdf"]), context=gl), "no texture coordinates"),
    (lambda _: read_scene(plate({"type": "diffuse", "reflectance": TURN})), "attribute vertex_o"),
    (lambda _: read_scene(scene_of(shape=skinned("disk", **PLACED))), "coherence='surface'"),
    # emitters
    (lambda _: lit(sky=sky()), "infinite or NaN"),
    (lambda _: lit(), "no emitter of the scene lights"),
    (lambda _: lit(dark={"type": "point", "intensity": {"type": "uniform", "value": 0.0}}),
     "no emitter of the scene lights"),
    # methods
    (lambda _: fragment_parts("phong", {}), "'phong' is unknown; choose one of fast, exact"),
    (lambda _: pack_powers(md.DiffractionTable.build(GRATING, coherence_width=2.4,
                                                     coherence="patch")),
     "coherence='patch'.*use method fast"),
    (lambda _: pack_table(load(thin_grating(0.5)).describe(), "flss"),
     "solved orders.*use method fast"),
    *((lambda _, methods=methods: shader(methods, int_ior=1.5), "choose from fast, exact")
      for methods in (["flss"], [], ["fast"] * 2)),
    (lambda _: make_page(scene_of(), methods=["flss"]), "choose from fast, exact"),
    (lambda _: shader(["fast"], int_ior=1.5, film_ior=1.8, film_thickness=90),
     "an exported shader cannot show"),
    (lambda _: make_shader(mi.load_dict({"type": "diffuse"}), ["fast"]), "does not diffract"),
    # drivers
    (lambda _: driver(310, 16384), r"Ancient has OpenGL 3\.1, .*need 3\.3"),
    (lambda _: driver(330, 1024), "Ancient supports textures of 1024 .* need 4096"),
    (lambda _: missing_driver(), "apt install libegl1"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("ask", "words"), REFUSED, ids=[f"{n}-{words}" for n, (_, words) in enumerate(REFUSED)]
)
def test_what_is_refused_says_why(gl: Any, some_variant: str, ask: Any, words: str) -> None:
    refused(lambda: ask(gl), words)
