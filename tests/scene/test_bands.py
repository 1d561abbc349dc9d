"""Films with a band for each receptor, against integrals of the reference."""

from __future__ import annotations

import math
import warnings

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.scene.bands import SensorBands
from mitsuba_diffraction.scene.load import load_scene
from tests.support.directions import polar, rough_patch
from tests.support.orders import thin_grating

pytestmark = pytest.mark.thorough

PIXEL, LIGHT, CAMERA = 0.06, (35.0, 20.0), (25.0, 220.0)
SCENE = """<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="orthographic">
        <transform name="to_world">
            <scale value="0.01"/>
            <lookat origin="{camera}" target="0, 0, 0" up="0, 0, 1"/>
        </transform>
        <sampler type="independent"/>
        <film type="{film}">{bands}
            <integer name="width" value="4"/>
            <integer name="height" value="4"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    {shapes}
    <emitter type="directional">
        <vector name="direction" value="{towards}"/>
        <spectrum name="irradiance" value="200:1, 5000:1"/>
    </emitter>
</scene>"""
FIELD = rough_patch((48, 48), (PIXEL, PIXEL), 0.02)


def surface(more="", *, heights="heights.npy", moved=""):
    """A rectangle with the rough surface, or that of a table."""
    texts = {"filename": heights}
    if heights.endswith(".npy"):
        texts |= {"pixel_size": PIXEL, "level": "none"}
    given = "".join(f'<string name="{name}" value="{text}"/>' for name, text in texts.items())
    bsdf = f'<bsdf type="diffraction">{given}{more}</bsdf>'
    return f'<shape type="rectangle">{moved}{bsdf}</shape>'


@pytest.fixture
def scene(tmp_path):
    """`scene(*shapes, spans=…)`: the file of a scene in light as strong at every wavelength.

    spans : ends of the film's bands, nm; otherwise it has colours.
    """
    np.save(tmp_path / "heights.npy", FIELD.heights)

    def write(*shapes, spans=()):
        camera, towards = (
            ", ".join(f"{x:.9f}" for x in way) for way in (5.0 * polar(*CAMERA), -polar(*LIGHT))
        )
        bands = "".join(
            f'<spectrum name="b{n}" value="{a}:1, {b}:1"/>' for n, (a, b) in enumerate(spans)
        )
        text = SCENE.format(
            camera=camera, towards=towards, shapes="".join(shapes), bands=bands,
            film="specfilm" if spans else "hdrfilm",
        )  # fmt: skip
        (tmp_path / "scene.xml").write_text(text)
        return tmp_path / "scene.xml"

    return write


def test_a_band_of_ultraviolet_is_the_reference_s_integral(scene, tmp_path):
    mi.set_variant("llvm_ad_spectral")
    file = scene(surface())
    field = md.HeightField.load(tmp_path / "heights.npy", pixel_size=PIXEL, level="none")
    nodes = np.arange(300.0, 701.0)
    spans = {"uv": (310.0, 340.0), "green": (520.0, 560.0)}
    bands = SensorBands(
        nodes.tolist(),
        {name: ((nodes >= a) & (nodes <= b)).astype(float).tolist()
         for name, (a, b) in spans.items()},
    )  # fmt: skip
    assert bands.first == 309.0
    loaded = load_scene(file, {}, bands=bands)
    picture = np.array(mi.render(loaded, spp=8192))
    assert picture.shape == (4, 4, 2)
    cosine = math.cos(math.radians(LIGHT[0]))
    for channel, (a, b) in enumerate(spans.values()):
        # trapezoids of the response, whose edges fall over 1 nm
        lam = np.arange(a - 1.0, b + 1.25, 0.25)
        f = [md.reference.brdf(field, polar(*LIGHT), polar(*CAMERA), x, eta=1.5)[0] for x in lam]
        response = np.interp(lam, [a - 1.0, a, b, b + 1.0], [0.0, 1.0, 1.0, 0.0])
        expected = cosine * np.trapezoid(np.array(f) * response, lam)
        # 1 %: the table's tolerance, and half a million wavelengths at random
        assert picture[..., channel].mean() == pytest.approx(expected, rel=0.01)


def test_tables_that_begin_at_longer_wavelengths_are_refused(scene, tmp_path):
    mi.set_variant("llvm_ad_spectral")
    md.DiffractionTable.build(FIELD).save(tmp_path / "table.exr")
    file = scene(surface(heights="table.exr"))
    with pytest.raises(md.DiffractionError, match="below 360 nm, where its table begins"):
        load_scene(file, {}, bands=SensorBands([300.0, 350.0, 400.0], {"u": [0.0, 1.0, 0.0]}))
    load_scene(file, {}, bands=SensorBands([400.0, 450.0, 500.0], {"s": [0.0, 1.0, 0.0]}))


#: A film's bands, nm, and whether each has light: none below the table's 360 nm, and all above.
RANGES = {
    "ultraviolet": {(200.0, 350.0): False},
    "infrared": {(850.0, 1500.0): True},
    "both and blue": {(200.0, 350.0): False, (400.0, 500.0): True, (850.0, 1500.0): True},
    "visible": {(360.0, 500.0): True, (500.0, 830.0): True},
    "all": {(200.0, 350.0): False, (3000.0, 5000.0): True},
}
DARK, INFRARED = (
    "is black below 360 nm, where its table begins",
    "has the values of 830 nm at all longer",
)
#: What the warning says of each, and its remedy; of the others there is none.
WARNED = {
    "ultraviolet": ([DARK], "(200, 830)"),
    "infrared": ([INFRARED], "(360, 1500)"),
    "both and blue": ([DARK, INFRARED], "(200, 1500)"),
    "all": ([DARK, INFRARED], "(200, 5000)"),
}


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "scalar_spectral"])
@pytest.mark.parametrize("case", RANGES)
def test_bands_that_the_table_lacks_have_a_warning_for_each_surface(scene, variant, case):
    spans = RANGES[case]
    mi.set_variant(variant)
    # equal surfaces would be merged
    turned = '<float name="orientation" value="30"/>'
    far = '<transform name="to_world"><translate z="-9"/></transform>'
    file = scene(surface(), surface(turned, moved=far), spans=spans)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", md.DiffractionWarning)
        loaded = load_scene(file, {})
    lines = [str(w.message) for w in caught if "the camera records" in str(w.message)]
    faults, remedy = WARNED.get(case, ([], ""))
    assert len(lines) == (2 if faults else 0)
    first, last = min(a for a, _ in spans), max(b for _, b in spans)
    for number, line in enumerate(lines, start=1):
        assert line.startswith(f"shape {number} (a rectangle without id) {faults[0]}")
        assert [f in line for f in (DARK, INFRARED)] == [f in faults for f in (DARK, INFRARED)]
        assert f"records {first:g} to {last:g} nm; make the table with wavel" in line
        assert f"wavelength_range={remedy} (the command" in line
    picture = np.array(mi.render(loaded, spp=16)).reshape(16, len(spans))
    assert np.isfinite(picture).all()
    assert ((picture > 0.0).any(axis=0) == list(spans.values())).all()


def test_solved_orders_are_named_with_their_own_range(scene, tmp_path):
    mi.set_variant("llvm_ad_spectral")
    thin_grating(0.6, counts=(2, 2, 1)).save(tmp_path / "orders.nc")
    shape = surface(heights="orders.nc").replace('"diffraction"', '"diffraction_orders"')
    file = scene(shape, spans=[(200.0, 600.0)])
    line = r"is black below [\d.]+ nm, .* make the table with a wider range of wave"
    with pytest.warns(md.DiffractionWarning, match=line):
        load_scene(file, {})


@pytest.mark.parametrize("wavelength", [200.0, 1500.0])
def test_mono_variants_refuse_wavelengths_outside_the_table(scene, wavelength):
    mi.set_variant("llvm_ad_mono")
    file = scene(surface(f'<float name="wavelength" value="{wavelength}"/>'))
    with pytest.raises(md.DiffractionError, match="outside the table's 360 to 830 nm"):
        load_scene(file, {})


def test_bands_begin_where_the_first_receptor_sees():
    assert SensorBands([400.0, 410.0, 420.0], {"s": [0.0, 0.0, 0.1], "m": [0.0] * 3}).first == 410.0
