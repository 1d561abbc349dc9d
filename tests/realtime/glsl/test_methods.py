"""The shaders' functions against the NumPy code that they are twins of."""

from __future__ import annotations

import dataclasses
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction.thesis.shaders  # noqa: F401 - registers its methods
from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, bsdf_dict
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.optics.boundary import MODELS
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.realtime.glsl.context import compile_program, compiler_words
from mitsuba_diffraction.realtime.glsl.export import make_shader
from mitsuba_diffraction.realtime.glsl.methods import METHODS
from mitsuba_diffraction.realtime.glsl.packing import (
    pack_boundary,
    pack_colours,
    pack_directions,
    pack_powers,
    pack_responses,
)
from mitsuba_diffraction.realtime.glsl.source import (
    fragment_parts,
    joined,
    web_source,
)
from mitsuba_diffraction.realtime.glsl.texels import (
    shortened,
)
from mitsuba_diffraction.tables.colour import ColourTable, colour_difference
from mitsuba_diffraction.tables.directional import FINE, DirectionalTable
from mitsuba_diffraction.thesis.methods import make
from tests.realtime.glsl.shaders import DAYLIGHT, PERFECT, difference, probed, shaded
from tests.support.directions import polar
from tests.support.lanes import interaction, vectors
from tests.support.patches import SMALL_SCAN

pytestmark = pytest.mark.thorough


def places(n: int, seed: int = 1) -> NDArray[np.float64]:
    """(u, v, z, 1) of random pairs of directions, a sixth of them close to the specular one."""
    rng = np.random.default_rng(seed)
    pairs = rng.normal(size=(2, n, 3))
    pairs /= np.linalg.norm(pairs, axis=-1, keepdims=True)
    pairs[..., 2] = np.abs(pairs[..., 2])
    near = np.arange(n) % 6 == 0
    pairs[1, near, :2] = -pairs[0, near, :2] + rng.normal(0.0, 0.01, (near.sum(), 2))
    pairs[1, near, 2] = pairs[0, near, 2]
    total = pairs.sum(axis=0)
    return np.concatenate([total, np.ones((n, 1))], axis=1).astype(np.float32).astype(float)


def summed(table: DiffractionTable, at: NDArray[np.float64], lit: Any = None) -> NDArray[Any]:
    """Colours (n, 3) by the table's own look-up at every quarter of a nanometre."""
    lam = np.arange(376.0, 744.0, 0.25) + 0.125
    weights = linear_srgb(response(lam)) * 0.25 / (lam[:, None] * 1e-3) ** 2
    if lit is not None:
        weights *= lit(lam)[:, None]
    k = 2e3 * np.pi / lam[:, None]
    return table.window_sum(k * at[:, 0], k * at[:, 1], k * at[:, 2]).T @ weights


@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
def test_lut_reads_a_colour_table_as_its_numpy_twin_does(
    gl: Any, patch: HeightField, coherence: str
) -> None:
    shallow = HeightField(patch.heights * 0.5, patch.pixel_size, name="shallow")
    table = DiffractionTable.build(shallow, coherence_width=4.0, coherence=coherence)
    colours = ColourTable.build(table)
    at = places(3000)
    found = probed(gl, "fast", pack_colours(colours) | PERFECT, at)
    halves = 6e4 / np.abs(colours.order_0).max()
    read = dataclasses.replace(
        colours,
        coefficients=shortened(colours.coefficients),
        order_0=(halves * colours.order_0).astype(np.float16).astype(np.float32) / halves,
    )
    # single precision, in the logarithm of the radius above all
    assert difference(found, read.colour(*at.T[:3])) < 1e-4
    # and eight digits of each number: what the eye can tell apart is one
    loss = colour_difference(colours, read)
    assert loss.mean() < 0.1
    assert np.percentile(loss, 99) < 0.5


@pytest.mark.parametrize(
    ("lit", "bounds"),
    # cut windows 2e-4, lobes averaged at two points to third order: 4e-3 measured
    [
        (np.ones_like, (8e-3, 4e-3, 2e-3)),
        (lambda lam: np.exp(-(((lam - 590.0) / 25.0) ** 2)), (1e-2, 1e-2, 4e-3)),
    ],
    ids=["daylight", "a light's own spectrum"],
)
def test_exact_sums_the_table_over_wavelengths(
    gl: Any, table: DiffractionTable, lit: Any, bounds: tuple[float, ...]
) -> None:
    at, grid = places(360), np.arange(360.0, 831.0)
    packed = pack_powers(table) | pack_responses([(grid, lit(grid))]) | PERFECT
    found, exact = probed(gl, "exact", packed, at), summed(table, at, lit)
    radius = np.hypot(at[:, 0], at[:, 1])
    for part, bound in zip((radius >= 0.0, radius > 0.5, radius < 0.05), bounds, strict=True):
        assert part.any()
        assert difference(found[part], exact[part]) < bound


def test_the_mirror_of_a_small_scan_has_the_light_s_window(gl: Any) -> None:
    table = DiffractionTable.build(SMALL_SCAN)
    assert table.order_0_ratio > 40.0  # of areas: the light is coherent over 65 µm
    at = places(600)
    # many in the lobe of the light, 0.3° wide
    at[::2, :2] = np.random.default_rng(3).normal(0.0, 0.006, (300, 2))
    expected = summed(table, at)
    shaders = {
        "exact": pack_powers(table) | pack_responses(DAYLIGHT),
        "fast": pack_colours(ColourTable.build(table)),
    }
    # the bounds of the tests above and below; of fast, eight digits and the rings between
    for (method, packed), bound in zip(shaders.items(), (8e-3, 2e-2), strict=True):
        found = probed(gl, method, packed | PERFECT, at)
        for part in (slice(0, None, 2), slice(1, None, 2)):
            assert difference(found[part], expected[part]) < bound, method


def test_amplitudes_serve_exact_as_powers(gl: Any, patch: HeightField) -> None:
    tables = [
        DiffractionTable.build(patch, coherence_width=6.5, basis=basis, tolerance=1e-3)
        for basis in ("svd", "taylor")
    ]
    assert [t.expansion.kind for t in tables] == ["power", "amplitude"]
    at = places(300)
    first, second = (
        probed(gl, "exact", pack_powers(t) | pack_responses(DAYLIGHT) | PERFECT, at) for t in tables
    )
    assert difference(second, first) < 2e-3  # both tables have an error of up to 1e-3


@pytest.mark.parametrize(
    ("name", "coherence"),
    [("flss", "ensemble"), ("flss", "patch"), ("nmm", "ensemble"), ("pq", "patch")],
)
def test_the_documents_methods_are_those_of_their_evaluators(
    gl: Any, name: str, coherence: str
) -> None:
    blazed = gratings.blazed(period=2.0, depth=0.2, periods=4)
    settings = {} if name == "pq" else {"taps": 3}
    method = make(
        name, blazed, coherence_width=8.0, coherence=coherence, terms=37, tolerance=0.02, **settings
    )  # fmt: skip
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-0.6, 0.6, (2, 600, 2))
    y[:, 1] = -y[:, 0] + rng.normal(0.0, 0.03, 600)  # where a grating sends light
    wi, wo = (
        np.stack([x[:, n], y[:, n], np.sqrt(1 - x[:, n] ** 2 - y[:, n] ** 2)], 1) for n in (0, 1)
    )
    total = wi + wo
    at = np.concatenate([total, np.ones((600, 1))], axis=1)
    mi.set_variant("llvm_ad_rgb")
    raw = {"material": "none", "energy_conserving": False}
    bsdf = mi.load_dict(bsdf_dict(blazed, coherence_width=8.0, coherence=coherence, **raw))
    packed = METHODS[name].tables(describe(bsdf))
    found = probed(gl, name, packed | pack_responses(DAYLIGHT) | PERFECT, at)
    outside = (0.5 * np.sum(total**2, axis=1) / total[:, 2]) ** 2 / (wi[:, 2] * wo[:, 2])
    found *= (outside * packed.uniforms["area_factor"])[:, None]

    expected = method.linear_srgb(wi, wo)
    bright = np.abs(expected).max(axis=1) > 0.01 * np.abs(expected).max()
    assert bright.sum() > 60
    norm = np.linalg.norm(expected[bright], axis=1)
    error = np.linalg.norm((found - expected)[bright], axis=1) / norm
    # the figure asked for; a line of nmm may come or go at the very end of the range
    assert np.quantile(error, 0.98 if name == "nmm" else 1.0) < 0.01


def test_orders_of_one_window_interfere_as_in_the_plugin(gl: Any) -> None:
    """Up to the horizon, where beats with the factor of all orders but 0 made light."""
    mi.set_variant("llvm_ad_rgb")
    ramp = HeightField(np.tile(np.linspace(0.0, 0.3, 50), (8, 1)), 0.05, periodic=True)
    bsdf = mi.load_dict(
        bsdf_dict(
            ramp, coherence="patch", coherence_width=3.0, material="none", energy_conserving=False
        )
    )
    rng = np.random.default_rng(5)
    wi = np.array([polar(*rng.uniform((60, 0), (88, 360))) for _ in range(200)])
    x, y = (rng.normal(0.0, 0.1, (200, 2)) - wi[:, :2]).T
    wo = np.stack([x, y, np.sqrt(np.maximum(1.0 - x**2 - y**2, 1e-4))], axis=1)
    si = interaction(wi, np.zeros((200, 4)))
    expected = np.array(bsdf.eval(mi.BSDFContext(), si, vectors(wo))).T
    # eight digits of each number of the shader's tables, 0.1 %; 3 % with one factor for all beats
    assert difference(shaded(gl, make_shader(bsdf, ["fast"]), wi, wo), expected) < 0.003


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("all_parts", [False, True])
def test_one_body_compiles_on_the_desktop_and_in_a_browser(
    gl: Any, table: DiffractionTable, method: str, all_parts: bool
) -> None:
    definitions = {"TEXELS": "2", "TAPS_X": "3", "TAPS_Y": "3", "DIFFRACTING": ""}
    if all_parts:
        scale = np.ones((FINE.polar + 1, FINE.azimuthal), np.float32)
        parts = ("COLOUR_MAPPED", "AXIS_MAPPED", "PIGMENTED", "VCAVITY", "COHERENT")
        definitions |= dict.fromkeys(parts, "") | {"SURFACE_KIND": "2"}
        excess = DirectionalTable(np.array([550.0]), 0.0 * scale[None])
        definitions |= pack_directions([excess, excess], [scale, scale]).definitions
        definitions |= pack_boundary(MODELS["small_slope"], table.roughness).definitions
    compile_program(gl, method, fragment_parts(method, definitions)).release()
    if "GL_ARB_ES3_compatibility" not in gl.extensions:
        pytest.skip(f"{gl.info['GL_RENDERER']} compiles no GLSL ES")
    gl.program(
        vertex_shader=web_source("surface.vert"),
        fragment_shader=joined(fragment_parts(method, definitions, "web")),
    ).release()


def test_a_shader_that_does_not_compile_is_named_with_its_line(gl: Any) -> None:
    definitions = {"TEXELS": "two"}
    body = dict(fragment_parts("exact", {}))["exact.glsl"].split("\n")
    line = next(n for n, text in enumerate(body, 1) if text.startswith("float series("))
    with pytest.raises(DiffractionError) as caught:
        compile_program(gl, "method exact", fragment_parts("exact", definitions))
    assert f"compile method exact: exact.glsl, line {line}: " in str(caught.value)
    assert "two" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "log",
    ["0:15(3): error: `a' undeclared", "0(15) : error C1503: undefined variable", "ERROR: 0:15: a"],
)
def test_the_logs_of_other_compilers_are_understood(log: str) -> None:
    parts = [("a.glsl", 10 * "\n"), ("b.glsl", 10 * "\n")]
    words = compiler_words(f"GLSL Compiler failed\n\nfragment_shader\n{log}\n", parts)
    assert words.startswith("b.glsl, line 5: ")
