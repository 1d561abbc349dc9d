"""One scan has one reflectance at a direction and one table, by every command and in Python."""

from __future__ import annotations

import csv
import gc
import math

import numpy as np
import OpenEXR
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.tables.store import VARIABLE
from tests.support.directions import polar
from tests.support.lanes import brdf_values

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("here")]

PIXEL, SIDE, PERIOD, WIDTH = 0.1, 160, 1.6, 10.0
LIGHT, WAVELENGTH = 30.0, 550.0
PIXELS = 769  # an odd number: the middle row is the plane of incidence
COLUMN = 323  # near the order of m = 1, on the light's side of the mirror direction
SINE = (2 * COLUMN + 1) / PIXELS - 1
DETECTOR = math.degrees(math.asin(-SINE))
HOW = ["--pixel-size", PIXEL, "--coherence-width", WIDTH]

SCENE = f"""<scene version="3.0.0">
    <integrator type="direct"/>
    <emitter type="directional">
        <vector name="direction" value="{-math.sin(math.radians(LIGHT))}, 0,
            {-math.cos(math.radians(LIGHT))}"/>
        <float name="irradiance" value="1"/>
    </emitter>
    <sensor type="orthographic">
        <transform name="to_world">
            <scale value="0.01"/>
            <lookat origin="{SINE}, 0, {math.sqrt(1 - SINE**2)}" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="2"/><integer name="height" value="2"/>
            <rfilter type="box"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="1"/></sampler>
    </sensor>
    <shape type="rectangle">
        <bsdf type="diffuse" id="skin"><float name="reflectance" value="0"/></bsdf>
    </shape>
</scene>"""


@pytest.fixture
def scan(here):
    """A grating along x, as a file of heights; the current folder holds it."""
    x = PIXEL * np.arange(SIDE)
    np.save("scan.npy", np.tile(0.05 * np.sin(2 * np.pi * x / PERIOD), (SIDE, 1)))
    (here / "scene.xml").write_text(SCENE, encoding="utf-8")
    return "scan.npy"


def in_python(scan, material, sine, wavelengths, phi=0.0):
    """π f of a direction in the plane y = 0, for light from 30°."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    how = {"pixel_size": PIXEL, "coherence_width": WIDTH, **material}
    bsdf = mi.load_dict(md.bsdf_dict(scan, **how))
    wo = np.array([sine, 0.0, math.sqrt(1.0 - sine**2)])
    many = np.ones((len(wavelengths), 1))
    wi = polar(LIGHT, phi)[None]
    return math.pi * brdf_values(bsdf, wi * many, wo * many, np.asarray(wavelengths))


@pytest.mark.parametrize("material", [{}, {"material": "keratin"}], ids=["default", "keratin"])
def test_every_command_and_python_give_one_reflectance_from_one_table(
    run, here, scan, material, monkeypatch
):
    gc.collect()  # or the table of the case before may serve from memory
    monkeypatch.setenv(VARIABLE, str(here / "cache"))
    option = [word for name, value in material.items() for word in (f"--{name}", value)]
    (expected,) = in_python(scan, material, SINE, [WAVELENGTH])
    assert expected > 0.05  # an order is there

    run(
        "spectrum", scan, *HOW, *option, "--light", LIGHT, "--detector", f"{DETECTOR:.6f}",
        "--acceptance", 0.1, "--wavelength-range", "550:551", "--step", 1, "-o", "s.csv",
    ).succeeded()  # fmt: skip
    with open("s.csv", encoding="utf-8") as stream:
        row = next(csv.reader(stream.readlines()[1:]))
    # six digits of the angle and a cone of 0.1° in a lobe of 1.4°
    assert float(row[1]) / 100 == pytest.approx(expected, rel=3e-3)

    run(
        "brdf-map", scan, *HOW, *option, "--theta", LIGHT, "--wavelength", WAVELENGTH,
        "--resolution", PIXELS, "-o", "m.exr",
    ).succeeded()  # fmt: skip
    with OpenEXR.File("m.exr", separate_channels=True) as file:
        (channel,) = (c.pixels for n, c in file.channels().items() if "550" in n or n == "Y")
    row = channel[PIXELS // 2, COLUMN]
    # the mean over a pixel of 0.0026 in a lobe of 0.025: 1e-3
    assert math.pi * float(row) == pytest.approx(expected, rel=3e-3)

    values = "".join(f",{name}={value}" for name, value in material.items())
    run(
        "render", "scene.xml", "-m", "llvm_ad_mono", "-o", "r.exr", "--assign",
        f"skin={scan},pixel_size={PIXEL},coherence_width={WIDTH},wavelength={WAVELENGTH}{values}",
    ).succeeded()  # fmt: skip
    with OpenEXR.File("r.exr", separate_channels=True) as file:
        radiance = float(np.mean(next(iter(file.channels().values())).pixels))
    # L = f E cosθi
    f = radiance / math.cos(math.radians(LIGHT))
    assert math.pi * f == pytest.approx(expected, rel=1e-3)

    run(
        "survey", scan, *HOW, *option, "--theta", LIGHT, "--resolution", 8, "-o", "survey"
    ).succeeded()
    with open("survey/survey.csv", encoding="utf-8") as stream:
        (row,) = csv.DictReader(stream)
    theta, phi = (float(row[f"brightest_{name}_deg"]) for name in ("theta", "phi"))
    across = math.radians(phi)
    sine = math.sin(math.radians(theta)) * math.cos(across)
    assert abs(math.sin(across)) < 0.05  # in the plane of incidence
    lam = np.arange(382.5, 780.0, 5.0)
    f = in_python(scan, material, sine, lam, float(row["light_phi_deg"]))
    daylight = 5.0 * response(lam)[:, 1] @ f
    # the table's tolerance, and cells of 0.008 in lobes of 0.0125
    assert float(row["brightest"]) == pytest.approx(daylight, rel=1e-2)
    # that of light that Mitsuba renders; of a period, `evaluate` has another one
    assert len(list((here / "cache").glob("table-*"))) == 1

    run(
        "evaluate", scan, *HOW, *option, "--theta", LIGHT, "--phi", 0, "--positions", 0,
        "--wavelength-range", "500:600", "--step", 10, "--angle-step", 1,
        f"--angles={DETECTOR - 20:.9f}:{DETECTOR + 20:.9f}", "-o", "e.png",
    ).succeeded()  # fmt: skip
    with np.load("e.npz") as saved:
        (line,) = np.nonzero(saved["wavelengths"] == WAVELENGTH)[0]
        column = np.abs(saved["angles"] - DETECTOR).argmin()
        f = saved["scatter"][line, column] / math.cos(math.radians(DETECTOR))
    assert math.pi * f == pytest.approx(expected, rel=1e-3)
