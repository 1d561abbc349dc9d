"""The exported shader in three.js, in a browser without a window, against our own renderer."""

from __future__ import annotations

import base64
import io
import mimetypes
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.realtime.glsl.export import export_shader, make_shader
from tests.support.browser import PATIENCE
from tests.support.pictures import by_methods

pytestmark = pytest.mark.thorough

THREE = "three@0.187.0"
SITE = "http://shader.test/"
SIDE = 96
TOWARDS = (0.4, -0.7, 0.6)  # the light
IRRADIANCE = 3.0
GREY = "color: new THREE.Color(0.1, 0.1, 0.1)"
GRATING = md.gratings.sinusoidal(period=1.6, depth=0.06, periods=4)
PAGE = f"""<!DOCTYPE html><script type="importmap">{{"imports": {{
    "three": "/node_modules/three/build/three.module.js",
    "three/addons/": "/node_modules/three/examples/jsm/"}}}}</script>
<script type="module">
import * as THREE from "three";
import {{ diffractionMaterial, sampled }} from "/out/diffraction.js";
window.THREE = THREE;
const renderer = new THREE.WebGLRenderer();
renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
const target = new THREE.WebGLRenderTarget({SIDE}, {SIDE}, {{ type: THREE.FloatType }});
const camera = new THREE.PerspectiveCamera(30, 1, 0.1, 100);
camera.up.set(0, 0, 1);
camera.position.set(0, -5, 2);
camera.lookAt(0, 0, 0);
// as Mitsuba's: poles on the z axis, u along the equator
const geometry = new THREE.SphereGeometry(1, 256, 128).rotateX(Math.PI / 2);
geometry.computeTangents();
window.draw = async (options, lit) => {{
    const scene = new THREE.Scene();
    scene.add(new THREE.Mesh(geometry, await diffractionMaterial("/out", options)));
    const light = new THREE.DirectionalLight(0xffffff, lit ? {IRRADIANCE} : 0);
    light.position.set({", ".join(map(str, TOWARDS))});
    scene.add(light);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0, 0);
    renderer.render(scene, camera);
    const numbers = new Float32Array({4 * SIDE * SIDE});
    renderer.readRenderTargetPixels(target, 0, 0, {SIDE}, {SIDE}, numbers);
    let text = "";
    for (const byte of new Uint8Array(numbers.buffer)) text += String.fromCharCode(byte);
    return btoa(text);
}};
// all of an environment's light from one of its texels, and where that is
window.spot = () => {{
    const width = 64, height = 32, at = 23 * width + 41;
    const data = new Float32Array(4 * width * height);
    data.set([1, 1, 1, 1], 4 * at);
    return sampled({{ image: {{ data, width, height }} }}, 4);
}};
window.white = () => {{
    const data = new Float32Array(8).fill(1);
    const texture = new THREE.DataTexture(data, 2, 1, THREE.RGBAFormat, THREE.FloatType);
    texture.needsUpdate = true;
    return texture;
}};
document.documentElement.dataset.state = "ready";
</script>"""


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three.js of the npm registry in it."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("no npm here, which fetches three.js")
    folder = tmp_path_factory.mktemp("three")
    command = [npm, "install", THREE, "--prefix", str(folder), "--no-audit", "--no-fund",
               "--ignore-scripts", "--fetch-retries=0", "--fetch-timeout=20000"]  # fmt: skip
    try:
        subprocess.run(command, check=True, capture_output=True, timeout=90, cwd=folder)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        pytest.skip(f"{THREE} cannot be fetched: {error}")
    return folder


@pytest.fixture(scope="module")
def sphere(scene: Any) -> Any:
    """A grating on a sphere in one directional light, in the variant of `scene`."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 30, "film": film,
                "to_world": transform().look_at([0, -5, 2], [0, 0, 0], [0, 0, 1]),
            },
            "ball": {
                "type": "sphere",
                "bsdf": md.bsdf_dict(
                    GRATING, coherence_width=6, int_ior=1.5,
                    pigment={"type": "diffuse", "reflectance": 0.1},
                ),
            },
            "sun": {
                "type": "directional", "direction": [-x for x in TOWARDS],
                "irradiance": {"type": "d65", "scale": IRRADIANCE} if mi.is_spectral
                else IRRADIANCE,
            },
        }
    )  # fmt: skip


@pytest.fixture(scope="module")
def exported(sphere: Any, three: Path) -> Path:
    """The sphere's shader in a folder beside three.js."""
    export_shader(sphere.shapes()[0].bsdf(), three / "out")
    (three / "index.html").write_text(PAGE, encoding="utf-8")
    return three


@pytest.fixture(scope="module")
def opened(browser: Any, exported: Path) -> Iterator[Any]:
    """The page of the material, served from the folder without a server."""
    page = browser.new_page(viewport={"width": 240, "height": 135})
    page.set_default_timeout(PATIENCE)
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("console", lambda message: said.append(message.text))

    def answer(route: Any) -> None:
        name = route.request.url.removeprefix(SITE).partition("?")[0] or "index.html"
        name = name.replace("out/node_modules", "node_modules")  # where the example has it
        kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
        route.fulfill(path=exported / name, content_type=kind)

    page.route(f"{SITE}**", answer)
    page.goto(SITE)
    page.wait_for_function("document.documentElement.dataset.state")
    yield page
    page.close()
    assert [line for line in said if "GPU stall" not in line] == []


def test_the_example_shows_colours(opened: Any) -> None:
    opened.goto(f"{SITE}out/example.html")
    opened.wait_for_function("document.documentElement.dataset.state")
    with Image.open(io.BytesIO(opened.screenshot())) as shot:
        pixels = np.asarray(shot.convert("RGB"), float)
    # neither grey nor one colour: red here, blue there
    redness = pixels[..., 0] - pixels[..., 2]
    assert (redness > 60).sum() > 5
    assert (redness < -60).sum() > 5
    opened.goto(SITE)
    opened.wait_for_function("document.documentElement.dataset.state")


def drawn(page: Any, options: str, lit: bool = True) -> NDArray[np.float32]:
    text = page.evaluate(f"async () => draw({options}, {str(lit).lower()})")
    return np.frombuffer(base64.b64decode(text), np.float32).reshape(SIDE, SIDE, 4)[::-1]


@pytest.fixture(scope="module")
def ours(sphere: Any) -> dict[str, NDArray[np.float32]]:
    """Pictures of `Renderer`, by method."""
    return by_methods(sphere, "fast", "exact")


@pytest.mark.parametrize("method", ["fast", "exact"])
def test_three_draws_what_the_renderer_draws(
    opened: Any, ours: dict[str, NDArray[np.float32]], method: str
) -> None:
    found, expected = drawn(opened, f"{{method: '{method}', {GREY}}}"), ours[method]
    inside = (found[..., 3] == 1.0) & (expected[..., 3] == 1.0)
    assert 0.3 < inside.mean() < 0.7
    errors = delta_e(expected[..., :3], found[..., :3])[inside]
    # another tessellation, and our `fast` in eight binary digits
    assert np.nanmean(errors) < 0.5
    assert expected[inside, :3].max() > 0.1
    total = expected[inside, :3].sum(axis=0)
    np.testing.assert_allclose(found[inside, :3].sum(axis=0), total, rtol=5e-3)


def test_an_environment_of_one_texel_is_a_directional_light(opened: Any) -> None:
    bright = drawn(opened, "{environment: spot(), color: 0x404040}", lit=False)[..., :3]
    opened.evaluate(
        """() => {
            const total = spot().filter((_, n) => n % 2).reduce((sum, x) => sum + x.x, 0);
            window.single = [spot()[0], new THREE.Vector3(total, total, total)];
        }"""
    )
    one = drawn(opened, "{environment: single, color: 0x404040}", lit=False)[..., :3]
    np.testing.assert_allclose(bright, one, rtol=1e-4, atol=1e-7)
    # radiance 1 from one of 64 × 32 cells
    row = 23.5 / 32 * np.pi - np.pi / 2
    solid = 2 * np.pi / 64 * np.pi / 32 * np.cos(row)
    np.testing.assert_allclose(opened.evaluate("single[1].x"), solid, rtol=1e-5)
    assert one.max() > 0.05 * solid


def test_a_white_room_is_mirrored_by_order_0(opened: Any) -> None:
    middle = drawn(opened, "{room: white(), color: 0}", lit=False)[SIDE // 2, SIDE // 2, :3]
    wavenumbers = 2.0 * np.pi / np.array([0.611, 0.549, 0.464])
    # a sinusoid of amplitude 0.03 µm and index 1.5 in normal light: 0.04 J₀²(2kA)
    expected = 0.04 * scipy.special.j0(0.06 * wavenumbers) ** 2
    # one wavelength for a channel, and a pixel that is seen 0.3° off the normal
    np.testing.assert_allclose(middle, expected, rtol=0.1)


@pytest.mark.parametrize(
    "surface",
    [
        {"material": "Al", "coat_ior": 1.5},
        {"int_ior": 1.5, "model": "kirchhoff", "pigment": {"type": "diffuse"}},
        {"int_ior": 1.7, "coat_ior": 1.5, "shadowing": "vcavity"},
    ],
    ids=["coated", "kirchhoff", "shadowed"],
)
def test_every_surface_is_valid_glsl_of_its_own(
    scene: Any, browser: Any, surface: dict[str, Any]
) -> None:
    import mitsuba as mi

    shader = make_shader(mi.load_dict(md.bsdf_dict(GRATING, coherence_width=6, **surface)))
    source = (
        "#version 300 es\nprecision highp float;\nprecision highp int;\n"
        "precision highp sampler2D;\n"
        # names that other programs have taken
        "#define PI 3.14159\n#define saturate(a) clamp(a, 0.0, 1.0)\nuniform float energy, eta;\n"
        f"{shader.code}\nin vec3 a, b;\nout vec4 colour;\nvoid main() {{ colour = vec4("
        "diffraction(a, b) + diffraction_exact(a, b) + diffraction_transmission(a, b)"
        "+ saturate(energy * eta * PI), 1.0); }"
    )
    page = browser.new_page()
    found = page.evaluate(
        """(source) => {
            const gl = document.createElement("canvas").getContext("webgl2");
            const program = gl.createProgram();
            const vertex = `#version 300 es
                out vec3 a, b;
                void main() { a = b = vec3(0, 0, 1); gl_Position = vec4(0, 0, 0, 1); }`;
            let said = "";
            for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, source]]) {
                const shader = gl.createShader(kind);
                gl.shaderSource(shader, text);
                gl.compileShader(shader);
                said += gl.getShaderInfoLog(shader);
                gl.attachShader(program, shader);
            }
            gl.linkProgram(program);
            const names = [];
            for (let n = 0; n < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++n)
                names.push(gl.getActiveUniform(program, n).name);
            return [said + gl.getProgramInfoLog(program), names];
        }""",
        source,
    )
    page.close()
    said, names = found
    assert said.strip("\0\n ") == ""
    # what the shader reads is what the constants give, or what the page declared
    given = set(shader.uniforms) | {texture.name for texture in shader.textures}
    assert set(names) - {"energy", "eta"} <= given
