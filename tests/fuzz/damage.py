"""Files with random damage: refused in one line, or read to something that can be used."""

from __future__ import annotations

import functools
import json
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.heights import Source
from mitsuba_diffraction.scene import load_scene
from mitsuba_diffraction.scene.orientation import load_mesh
from mitsuba_diffraction.tables.document import parse_document, shape_of, with_coefficients
from tests.support.directions import rough_patch
from tests.support.instruments import nanoscope
from tests.support.lanes import evaluated
from tests.support.meshes import ply_text
from tests.support.table_files import document_in

#: LLVM, where reading outside of an array is no error but may end the process, compiles for each
#: table: of so many tables one has its turn.
_COMPILED = 40


def _check_window_sums(table: DiffractionTable) -> None:
    """Finite numbers of a sane size for all frequencies and κ that a table is for."""
    rng = np.random.default_rng(0)
    radius, turn = table.q_limit * np.sqrt(rng.random(300)), rng.uniform(0, 2 * np.pi, 300)
    limit = table.q_limit * table.height_scale_max
    kappa = np.concatenate([[0.0, limit], rng.uniform(0.0, limit, 298)])
    found = table.window_sum(radius * np.cos(turn), radius * np.sin(turn), kappa)
    assert np.isfinite(found).all()
    assert np.abs(found).max() < 1e9


def _check_compiled(path: Path) -> None:
    mi.set_variant("llvm_ad_spectral")
    rng = np.random.default_rng(1)
    tangential = rng.uniform(-0.7, 0.7, (2, 64, 2))
    wi, wo = (np.c_[uv, np.sqrt(1.0 - (uv**2).sum(axis=1))] for uv in tangential)
    value = evaluated(_loaded(path), wi, wo, rng.uniform(360.0, 830.0, (64, 4)))
    assert np.isfinite(value).all()
    assert (value >= 0.0).all()
    assert value.max() < 1e9


def use_table(path: Path) -> DiffractionTable:
    """A table whose values are sane; a DiffractionError if it is refused."""
    table = DiffractionTable.load(path)
    _check_window_sums(table)
    _look_up(table)
    mi.set_variant("scalar_spectral")  # where reading outside of an array is an error
    bsdf = _loaded(path)
    if bsdf is not None:
        look_up_in_plugin(bsdf)
        if int(table.digest(), 16) % _COMPILED == 0:
            _check_compiled(path)
    return table


def _loaded(path: Path) -> Any:
    """The plugin with a table, or None if it refuses it."""
    scene = {"type": "diffraction", "filename": str(path), "energy_conserving": False}
    try:
        return mi.load_dict({**scene, "material": "none"})
    except RuntimeError as error:
        assert "DiffractionError: " in str(error), str(error)[-200:]
        return None


def look_up_in_plugin(bsdf: Any) -> None:
    """Values, densities and samples are finite and not negative."""
    rng = np.random.default_rng(2)
    context, si = mi.BSDFContext(), dr.zeros(mi.SurfaceInteraction3f)
    for _ in range(4):
        wi, wo = (np.append(p, np.sqrt(1.0 - p @ p)) for p in rng.uniform(-0.7, 0.7, (2, 2)))
        si.wi, si.wavelengths = mi.Vector3f(wi), mi.Spectrum(rng.uniform(360.0, 830.0, 4))
        si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
        value, density = bsdf.eval_pdf(context, si, mi.Vector3f(wo))
        drawn, weight = bsdf.sample(context, si, rng.random(), mi.Point2f(rng.random(2)))
        numbers = np.array([*value, density, drawn.pdf, *weight])
        assert np.isfinite(numbers).all(), "not finite in the plugin"
        assert (numbers >= 0.0).all(), "negative in the plugin"
        assert numbers[:4].max() < 1e9, "too bright in the plugin"


def _look_up(table: DiffractionTable) -> None:
    rng = np.random.default_rng(1)
    wi, wo = rng.normal(size=(2, 16, 3))
    for w in (wi, wo):
        w[:, 2] = np.abs(w[:, 2]) + 0.1
        w /= np.linalg.norm(w, axis=1)[:, None]
    low, high = table.wavelength_range
    value = table.brdf(wi, wo, rng.uniform(low, high, 16))
    assert np.isfinite(value).all()
    assert (value >= 0.0).all()
    assert value.max() < 1e9


_MOST = 500  # characters of a message
_MOST_NUMBERS = 10**6  # of a table
_HEIGHTS = (".png", ".tiff", ".bmp", ".npy", ".txt", ".csv", ".spm")
_RECIPE = 'generator = "sinusoidal"\ncoherence_width = 4\n[arguments]\nperiod = 1.6\ndepth = 0.06\n'
_PLY = ply_text([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], "xyz")
_OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n"
_GWYDDION = "# Channel: Height\n# Width: 2.4 µm\n# Height: 2 µm\n# Value units: nm\n"
_SCENE = """<scene version="3.0.0"><default name="width" value="4"/>
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="$width"/>
<integer name="height" value="4"/></film></sensor>
<shape type="sphere" id="ball"><transform name="to_world"><scale value="0.5"/></transform>
<bsdf type="diffraction" id="skin"><string name="filename" value="TABLE"/>
<string name="material" value="Al"/><boolean name="energy_conserving" value="false"/>
<float name="orientation" value="30"/><float name="height_scale" value="1.2"/></bsdf></shape>
<emitter type="point"><point name="position" value="0,0,-4"/></emitter></scene>
"""


@functools.cache
def originals() -> dict[str, bytes]:
    """Small whole files by name."""
    field = rough_patch((20, 24), (0.1, 0.1), 0.1)
    grey = np.uint8(255 * (field.heights - field.heights.min()) / np.ptp(field.heights))
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        for name, more in {
            "ensemble.exr": {}, "patch.exr": {"coherence": "patch"},
            "chebyshev.exr": {"basis": "chebyshev", "tolerance": 1e-4},
            "taylor.exr": {"basis": "taylor"}, "limited.exr": {"frequency_limit": [9.0, 7.0]},
        }.items():  # fmt: skip
            md.DiffractionTable.build(field, coherence_width=2.0, **more).save(at / name)
        for suffix in ("png", "tiff", "bmp"):
            Image.fromarray(grey).save(at / f"grey.{suffix}")
        Image.fromarray(grey.astype(np.uint16) * 257).save(at / "deep.png")
        np.save(at / "heights.npy", field.heights)
        np.savetxt(at / "heights.txt", field.heights)
        (at / "scan.spm").write_bytes(nanoscope(np.int16(1000 * field.heights), scan_size="2 2 ~m"))
        (at / "recipe.toml").write_text(_RECIPE)
        (at / "mesh.ply").write_text(_PLY)
        (at / "mesh.obj").write_text(_OBJ)
        np.savetxt(at / "gwyddion.txt", field.heights, header=_GWYDDION, comments="")
        np.savetxt(at / "heights.csv", field.heights, delimiter=",")
        return {path.name: path.read_bytes() for path in sorted(at.iterdir())}


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """The file with a bit flipped, a piece lost, doubled, moved or overwritten."""
    data = bytearray(content)
    start, stop = sorted(rng.integers(len(data) + 1, size=2))
    # most of what matters lies at the beginning
    if rng.random() < 0.5:
        start, stop = sorted(rng.integers(min(len(data), 600) + 1, size=2))
    kind = rng.integers(6)
    if kind == 0 and data:
        data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del data[start:]
    elif kind == 2:
        del data[start : min(stop, start + 40)]
    elif kind == 3:
        data[start:start] = data[start : min(stop, start + 200)]
    elif kind == 4:
        data[start : min(stop, start + 8)] = rng.bytes(min(8, int(stop - start)))
    else:
        _other_number(rng, data)
    return bytes(data)


def _other_number(rng: np.random.Generator, data: bytearray) -> None:
    """Replace one of the numbers that stand in the file as text."""
    digits = [n for n, byte in enumerate(data) if chr(byte).isdigit()]
    if digits:
        words = [b"-1", b"0", b"1e400", b"nan", b"999999999999", b"null", b"[]", b'"a"']
        place = digits[rng.integers(len(digits))]
        data[place : place + 1] = words[rng.integers(len(words))]


def check_table(rng: np.random.Generator) -> None:
    """A table is refused, or it is the one before the damage."""

    def use(path: Path) -> None:
        table = use_table(path)
        whole, _ = original(path.name)
        assert (table.digest(), table.source) == (whole.digest(), whole.source)

    _check(rng, [name for name in originals() if name.endswith(".exr")], use)


def check_document(rng: np.random.Generator) -> None:
    """A table that another program wrote without care is refused, or its values are sane."""
    name = str(rng.choice([name for name in originals() if name.endswith(".exr")]))
    document = json.loads(original(name)[1])
    _mutate(rng, document)
    try:
        found = parse_document(document)
        # as many numbers as it declares, which `exr` compares with the file's size
        if int(np.prod(shape_of(found))) > _MOST_NUMBERS:
            return
        coefficients = rng.normal(0.0, 1e-3, shape_of(found)).astype(np.float32)
        if rng.random() < 0.2 and coefficients.size:
            place = rng.integers(coefficients.size)
            coefficients.flat[place] = rng.choice([np.nan, np.inf, 1e4, -6e4, 1.0])
        table = with_coefficients(found, coefficients)
    except (md.DiffractionError, ValueError, MemoryError):  # what `load_table` makes one line of
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "table.exr")
        table.save(path)
        use_table(path)


def _mutate(rng: np.random.Generator, document: Any) -> None:
    """Replace a value somewhere in nested data, or leave it out."""
    place = document
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = keys[rng.integers(len(keys))]
        if not isinstance(place[key], (dict, list)) or not place[key] or rng.random() < 0.15:
            break
        place = place[key]
    if rng.random() < 0.1:
        del place[key]
        return
    old = place[key]
    numbers = [-1, 0, 1, 2, 3, 1000, 10**12, 0.5, 1e-30, 1e30, 1e300, math.nan, math.inf]
    words: list[Any] = [None, True, "", "patch", "ensemble", "svd", [], {}, [1, 2], [[1.0]]]
    if isinstance(old, (int, float)) and not isinstance(old, bool) and rng.random() < 0.7:
        words = [old * 2, old + 1, -old, old * (1 + 1e-3), *numbers]
    place[key] = [*words, *numbers][rng.integers(len(words) + len(numbers))]


@functools.cache
def original(name: str) -> tuple[DiffractionTable, str]:
    """A table, and the plain data in its file as JSON, without the version."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(originals()[name])
        document = document_in(path)
        del document["version"]
        return DiffractionTable.load(path), json.dumps(document)


def check_heights(rng: np.random.Generator) -> None:
    """Heights are refused, or finite."""
    names = [n for n in originals() if Path(n).suffix in _HEIGHTS]
    _check(rng, names, _use_heights)


def check_text(rng: np.random.Generator) -> None:
    """Recipes and meshes."""
    _check(rng, ["recipe.toml"], lambda path: Source.of(path))
    _check(rng, ["mesh.ply", "mesh.obj"], lambda path: load_mesh(path))


def check_scene(rng: np.random.Generator) -> None:
    """A scene is refused in one line, or its surface can be looked up."""
    with tempfile.TemporaryDirectory() as folder:
        table, scene = Path(folder, "table.exr"), Path(folder, "scene.xml")
        table.write_bytes(originals()["ensemble.exr"])
        scene.write_bytes(damaged(rng, _SCENE.replace("TABLE", str(table)).encode()))
        mi.set_variant("scalar_spectral")
        try:
            loaded = load_scene(scene, {})
        except md.DiffractionError as error:
            check_line(error)
            return
        for shape in loaded.shapes():
            if shape.bsdf() is not None and "Diffraction[" in str(shape.bsdf()):
                look_up_in_plugin(shape.bsdf())


def _check(rng: np.random.Generator, names: list[str], use: Callable[[Path], object]) -> None:
    name = names[rng.integers(len(names))]
    check_damaged(rng, name, originals()[name], use)


def check_damaged(
    rng: np.random.Generator, name: str, content: bytes, use: Callable[[Path], object]
) -> None:
    """Damage a file: it is refused in one line, or can be used."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(damaged(rng, content))
        try:
            use(path)
        except md.DiffractionError as error:
            check_line(error)


def check_line(error: md.DiffractionError) -> None:
    """An error is one line, and no long one."""
    assert len(str(error)) <= _MOST, "too long a message"
    assert "\n" not in str(error), "more than one line"


def _use_heights(path: Path) -> None:
    field = md.HeightField.load(path, pixel_size=0.1, max_height=0.1)
    assert np.isfinite(field.heights).all()
