"""What commands refuse: one line that says what and where, an exit code, and nothing written.

A refusal is one row: the words after the command's own, and what the line says.
"""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from tests.support import room
from tests.support.logos import write_board
from tests.support.room import plate_file

_PIXEL = "--pixel-size 0.08"
_SMALL = f"{_PIXEL} --coherence-width 6"
_MAP = f"brdf-map grating.npy {_SMALL} --resolution 32 --step 47"
_SPECTRUM = f"spectrum grating.npy {_SMALL} --wavelength-range 400:700 --step 50"
_SWEEP = f"grating.npy {_SMALL} --resolution 32 --step 47"
_PRECOMPUTE = f"precompute grating.npy {_SMALL}"
_RENDER = "render room.xml -m scalar_rgb"
_FRAMES = f"{_RENDER} --frames 2"
_LIGHT = "--animate spp=1:2"
_GROOVE = "sinusoidal --period 1 --depth 0.1"
_EVALUATE = (
    "evaluate grating.npy --pixel-size 0.08 --coherence-width 12 --step 40 --angle-step 0.5 "
    "--positions 2 --periodic exact"
)
_SKY = room.PLATE.format(bsdf=room.SKIN).replace(
    "</scene>", '<emitter type="envmap"><string name="filename" value="{}"/></emitter></scene>'
)

#: Beginnings of files, called `NAME.exr`.
DAMAGED = {"empty": b"", "exr": b"\x76\x2f\x31\x01", "png": b"\x89PNG\r\n\x1a\n", "ab": b"ab"}

#: Command lines that name an unsuitable file or value, and the message: exit code 1.
REFUSED = {
    _MAP: {
        "-m scalar_rgb": "variant 'scalar_rgb' does not support maps",
        "--coherence-width -1": "--coherence-width '-1' must be",
        "-o missing/a.exr": "cannot write 'missing/a.exr'",
        "--material Unobtainium": "Unobtainium",
        "--fill hope": "--fill 'hope' must be one of",
        "--method flss --relative --int-ior glass": "takes a number",
    },
    "brdf-map": {
        "t.exr -o t.exr": "would overwrite",
        "t.exr --ext-ior water": "t.exr",
        "t.exr --resolution 8 --step 100 -m llvm_ad_mono": "variant 'llvm_ad_mono'",
        "nothing.png": "nothing.png",
        "--preset dvdd": "did you mean dvd",
        "--preset cd --material gold": "'cd' is a table, which has its own; leave --material out",
        "noise.npy --pixel-size 0.08 --method rainbow": "needs a period",
        "grating.npy --pixel-size 0.08 --method rainbow --relative": "no relative reflectance",
        "grating.npy --resolution 8": "give --pixel-size in µm, for instance --pixel-size 0.05",
        "grating.npy --pixel-size 0.08 --material n.csv": "--material 'n.csv': only",
        "grating.npy --pixel-size 0.08 --coat-ior watr": "did you mean water",
        "orders.nc --material gold": "a table, which has its own; leave --material out",
        "orders.nc --fill nearest": "a table, which has its own; leave --fill out",
    },
    _SPECTRUM: {
        "--detector 89.5": "89.5",
        "--light 90": "90",
        "--acceptance 0": "acceptance",
        "--light-azimuth 1000": "1000",
        "--material kerratin": "keratin",
        "--pigment none.csv": "none.csv",
        "--material gold --pigment 0.2": "gold",
        "--crops 400": "--crops 400: ",
        "--measured none.csv": "'none.csv' does not exist",
        "--measured measured.csv": "and the spectrum 400 to 700 nm; give others by",
        "--observer dragon": "dragon",
        "--observer dog --cone-ratios 1,2,3": "expected 2 numbers",
    },
    # heights with notes, which would be in vain
    f"spectrum noise.npy {_SMALL}": {"--coat-ior 0.5": "--coat-ior 0.5 must be"},
    f"brdf-map noise.npy {_SMALL}": {"--coat-ior 0.5": "--coat-ior 0.5 must be"},
    "spectrum": {
        "empty": "empty",
        "none*.npy": "none*.npy",
        "--group a=none*.npy": "no file",
        "nothere": "'nothere' does not exist",
        "--group a=grating.npy --group b=nothere": "'nothere' does not exist",
    },
    "survey": {
        "nothere": "'nothere' does not exist",
        "empty": "holds no scans; name another folder",
        "parent": "name those in its folders, 'parent/*/*'",
    },
    "survey grating.npy": {"-o out.csv": "writes several files; name a folder"},
    "survey grating.npy -o out": {
        "--pixel-size 0.08 --coat-ior 0.5": "--coat-ior 0.5 must be",
        "--material kerratin": "kerratin",
        "--ext-ior melanin": "melanin",
        "--pigment blueish": "blueish",
        "--pigment 0.2 --material gold": "gold",
    },
    _EVALUATE: {
        "--theta 95": "--theta 95 must be",
        "--method pq --tolerance 0": "--tolerance 0",
        "--coherence-width 1e300": "--coherence-width '1e300'",
        "--angles 20:10": "--angles 20:10 degrees are none",
        "--angle-step 0": "angle-step=0 does not fit",
        "--period 0": "--period 0.0 must be",
        "--order 0": "--order 0 is",
        "--material kerratin": "did you mean keratin",
        "--material keratin --method flss": "--method flss reflects all light",
        "--material keratin --coherence patch": "--coherence patch reflects all light",
        "-o missing/a.png": "cannot write",
    },
    "evaluate": {
        "t.exr": "is a table; this needs the heights",
        "grating.npy --pixel-size 0.08 --positions 5000": "--positions 5000 must be",
    },
    f"sweep terms {_SWEEP}": {
        "--coherence-width 1e300": "--coherence-width '1e300'",
        "--values a": "--values: expected numbers, blanks between, got 'a'",
    },
    _PRECOMPUTE: {
        "--pixel-size 0": "'0'",
        "--pixel-size nan": "'nan'",
        "--max-height 0.3 --height-unit nm": "without --max-height",
        "--level tilt": "'tilt'",
        "--tolerance nan": "tolerance",
        "--coherence-width 0": "--coherence-width '0'",
        "--wavelength-range 700:400": "wavelength",
        "--basis taylor --tolerance 1e-12": "tolerance",
        "--channel Height": "channel",
        "--crop 7": "crop to 7 x 7 µm is larger than the patch",
        "-o nowhere/table.exr": "cannot write 'nowhere/table.exr'",
        "-o /proc/table.exr": "cannot write '/proc/table.exr'",
        "-o folder.exr": "cannot write 'folder.exr'",
        "--pixel-size 80": "is the pixel size of 80 µm in nm? Then divide it by 1000",
    },
    "precompute": {
        "scale.png --pixel-size 0.1": "--max-height 0.375",
        "scale.png --max-height 0.1": "--pixel-size",
        "wrong.toml": "'wrong.toml': tolerance=2",
        "long.toml": "is not TOML: the number",
        "none.npy": "'none.npy'",
        "empty.npy": "'empty.npy'",
        "cut.npy": "'cut.npy'",
        "words.npy": "'words.npy'",
        "empty": "is a folder",
        f"nm.npy {_SMALL}": "are the heights, with a range of ",
    },
    "tangents": {
        "none.obj -o a.ply": "'none.obj' does not exist",
        "mesh.ply -o no/a.ply": "cannot write 'no/a.ply'",
    },
    "tonemap": {
        "none.exr": "none.exr",
        "words.exr": "cannot read",
        "words.npy": "not an EXR",
        "depth.exr": "holds no colours",
        ".": "is a folder",
        "/": "is a folder",
    },
    "info": {
        "what.exr": "'what.exr'",
        **{f"{name}.exr": f"'{name}.exr'" for name in DAMAGED},
        **{f"{name}.ply": f"'{name}.ply'" for name in ("empty", "ply", "words")},
        "words.stl": "convert it to PLY or OBJ",
        "room.xml": "is a scene, which `mitsuba-diffraction render` renders; info describes",
        "a.sxm": "Gwyddion",
        f"grating.npy {_PIXEL} --crop 1e308": "larger than the patch",
    },
    "solve": {
        "lamellar --depth 0.1": "period",
        "lamellar --period 1": "depth",
        "missing.csv --period 1": "missing.csv",
        "long.toml": "is not TOML: the number",
        "heap --period 1": "expected one of",
        "lamellar --period 1 --depth 0.1 --layer silicn:0.1": "layer 1: material='silicn'",
    },
    f"solve {_GROOVE}": {"--duty 0.5": "duty", "--material Unob": "Unob", "-o no/x.nc": "folder"},
    **{
        command: {"groove.toml": "run the command 'solve groove.toml'"}
        for command in ("precompute ", "info ", "brdf-map ", "evaluate ", "spectrum ")
    },
    "plan scale.xml": {
        "-D widht=3": "did you mean width?",
        "-D width=0": "a picture of 0 x 4 pixels has none",
    },
    "hologram": {
        "red.png": "no colour beside its ground",
        "none.png": "'none.png' does not exist",
        "logo.png --mesh line.obj": "on a line",
        "logo.png --mesh bare.obj": "no texture coordinates",
    },
    "export-osl": {
        "missing.nc": "missing.nc",
        "orders.nc -o orders.nc": "it is a file",
        "orders.nc -o orders.nc/in": "cannot write",
        "--addon a.zip --with empty": "export-osl",
        **dict.fromkeys(
            [f"orders.nc -o out --name {n}" for n in ("'a b'", "while", "mix")], "--name "
        ),
    },
    "export-shader": {
        "missing.toml": "missing.toml",
        "grating.toml -o grating.toml": "cannot write",
        "grating.toml --mode scalar_rgb": "llvm_ad_rgb",
    },
    "export-viewer": {
        "plate.xml -o missing/a.html": "cannot write",
        "plate.xml -o folder.html": "it is a folder",
        "plate.xml -o a.html -m scalar_rgb": "set llvm_ad_rgb or llvm_ad_spectral",
        "plate.xml -o a.html -m llvm_ad_mono": "set llvm_ad_rgb or llvm_ad_spectral",
        "dull.xml -o a.html": "diffracts",
        "sky.xml -o a.html": "empty.exr",
        "skyless.xml -o a.html": "missing.exr",
    },
    "compare": {
        "plate.xml -o compared -m scalar_rgb": "set llvm_ad_rgb or llvm_ad_spectral",
        "plate.xml -o words.npy": "it is a file; name a folder",
        "plate.xml -o /proc/none/here": "cannot write",
    },
    _RENDER: {
        "-D ssp=3": "did you mean spp?",
        "-D parallel=3": "no parameter 'parallel'",
        "-D spp=many": "could not parse",
        "-m cuda_rgb": "there is no variant 'cuda_rgb'; there are scalar_rgb",
        "-o nowhere/a.exr": "cannot write 'nowhere/a.exr'",
        "-o /proc/a.png": "cannot write '/proc/a.png'",
        "--observer dragon": "avian_uv",
        "--observer dog -m llvm_ad_rgb": "spectral",
        "--observer avian": "did you mean avian_v or avian_uv?)",
        "--observer dog --illuminant leafs -m scalar_spectral": "did you mean leaves?)",
    },
    _FRAMES: {
        "--turn nowhere": "error: 'room.xml' has no parameter 'nowhere'; it has",
        "--turn format": "the turn of format begins at 'rgb', which is not an angle",
        "--animate ssp=0:1": "did you mean spp?",
    },
    "render": {
        "none.xml": "none.xml",
        "empty": "is a folder",
        "grating.npy": "'grating.npy' (array) is neither a scene (XML) nor a mesh",
        "recipe.toml": "'recipe.toml' (recipe) is neither a scene (XML) nor a mesh",
        "room.xml --plan no.toml -o a.exr": "no.toml' does not exist",
    },
}

#: Command lines with unsuitable options, and the message after the command's name: exit code 2.
USAGE = {
    _MAP: {
        "--wavelength 500": "argument --step: has no effect with one --wavelength",
        "-o a.png --spectral": "--spectral: bands need an EXR",
        "-o a.jpg": "expected a name ending in .exr or .png",
        "--material Al --int-ior 1.5": "--int-ior: not allowed with",
        "--illuminant A": "--illuminant: invalid choice: 'A'",
        "--preset dvd": "SOURCE or --preset",
        "--method flss --material Al": "--material: not allowed with",
        "--method flss --spectral": "--spectral: not allowed with",
        "--method flss --illuminant E": "--illuminant: not allowed with argument --method",
        "--method flss --int-ior 1.5": "only for --relative",
        "--method rainbow": "argument --step: has no effect with --method rainbow",
        "--relative": "--relative: only with argument --method",
        "--method ray": "--method: invalid choice",
    },
    "brdf-map grating.npy": {
        "--wavelength 550 --exposure 0": "argument --exposure: has no effect with one --wavelength",
        "--wavelength 550 --illuminant E": "argument --illuminant: has no effect",
        "--method spectral --terms 5": "argument --terms: has no effect with --method spectral",
        "--method pq --coherence patch": "argument --coherence: has no effect with --method pq",
    },
    "brdf-map": {
        "--preset snake,orientation=3": "name the preset alone",
        "--preset snake --wavelength 550,600": "from 10 to 100000, got '550,600'",
        "--preset snake --theta 1,2": "expected one number, got '1,2'",
    },
    "evaluate grating.npy --pixel-size 0.08": {
        "--method rainbow --tolerance 0.1": "argument --tolerance: has no effect",
        "--coherence patch --terms 5": "argument --terms: has no effect",
    },
    **{
        f"sweep {kind} grating.npy --pixel-size 0.08": {
            option: f"{option.split()[0]}: has no effect"
        }
        for kind, option in (
            ("wavelength-step", "--step 5"),
            ("coherence-width", "--coherence-width 30"),
            ("terms", "--terms 3"),
            ("light-angle", "--theta 0"),
            ("method", "--method flss"),
        )
    },
    "sweep terms grating.npy": {
        "--no-compiled": "--no-compiled: is for a sweep over methods",
        "--period 2": "--period: has no effect with --method flss",
    },
    "hologram logo.png": {"--turn 0": "--turn: is for a label on a mesh"},
    "tradeoff": {"--pixel-size 0.1": "--pixel-size: needs a file of HEIGHTS"},
    "spectrum": {
        "--group a": "NAME=PATTERN",
        "--group a-b=grating.npy --group a_b=grating.npy": "columns of 'a_b'",
        "": "give files",
        "grating.npy --detector 5:1:1": "5:1:1",
        "grating.npy --azimuth north": "north",
        "grating.npy --measured a.csv --detector 0 5": "--measured: is compared with one curve",
        "grating.npy --measured a.csv --relative none": "--measured: is compared with one curve",
    },
    _PRECOMPUTE: {
        "--coherence nonsense": "nonsense",
        "--basis fourier": "fourier",
        "--terms 0": "0",
        "--terms many": "many",
        "--tolerance small": "small",
        "--wavelength-range 400": "400",
        "-o table.png": "table.png",
        "--levels plane": "--levels",
    },
    "precompute": {
        "recipe.toml recipe.toml -o a.exr": "--output",
        "recipe.toml grating.npy": "cannot be mixed",
        "grating.npy grating.npy": "--output",
    },
    "tangents mesh.ply": {
        "": "-o",
        "-o a.obj": ".ply",
        "-o a.ply --along w": "'w'",
        "-o a.ply --rotate x": "'x'",
        "-o a.ply --smoothing 0.1": "--smoothing: has no effect without a guide",
    },
    "export-osl": {
        "orders.nc --material Al --int-ior 1.5": "not allowed with",
        "orders.nc --addon a.zip": "--addon",
        "--addon a.zip --name b": "--name: not allowed with argument --addon",
        "--addon a.zip --material gold": "--material: not allowed with argument --addon",
    },
    "export-shader": {
        "grating.toml --material Al --int-ior 1.5": "not allowed with",
        "grating.toml --method flss": "invalid choice",
    },
    "export-viewer plate.xml": {"-o page.pdf": ".html"},
    "info": {
        "": "--formats",
        "a.png --formats": "argument FILE with --formats",
        "--formats --level plane": "--level",
        f"t.exr {_PIXEL}": "--pixel-size",
        "t.exr --picture a.png": "is a table, not heights",
        "t.exr --coherence-width 5": "is a table, not heights",
        "t.exr --wavelength-range 400:700": "is a table, not heights",
        f"grating.npy {_PIXEL} --albedo a.png": "not a table",
    },
    "solve lamellar --period 1 --depth 0.1": {
        "--layer digits.toml": "argument --layer: 'digits.toml' is not TOML"
    },
    "render": {
        "--plan scale.xml": "to have one made, write SCENE --plan",
        "scale.xml --paths 9": "--paths: is for --plan",
        "scale.xml --paths 131072": "--paths: is for --plan",
        "scale.xml --plan a.toml --paths 9": "--paths: has no effect on the recipes of --plan",
        "scale.xml --plan --frames 2 --turn width": "argument --plan: is for one picture",
    },
    "plan scale.xml": {
        "--paths 1": "expected a whole number from 2",
        f"--paths {2**23}": "--paths: expected a whole number from 2 to 4194304",
    },
    _RENDER: {
        "-D spp": "-D",
        "-D =3": "-D",
        "-D spp=1 -D spp=2": "spp",
        "-s 0": "-s",
        "-s few": "-s",
        "--seed -1": "--seed",
        "--exposure nan": "--exposure",
        "-o a.jpg": "a.jpg",
        "-o folder": "folder",
        "--observer dog --denoise": "one picture in one process",
        "--denoise --workers 2": "is for one process",
        "--observer dog -o a.png": "writes an EXR",
        "--illuminant leaves": "--observer; name one",
        "--observer dog --tonemap natural": "--tonemap: has no effect",
        "--frames 2": "say what changes, with --animate or --turn",
        _LIGHT: "--animate: belongs to --frames",
        "--fps 3": "--fps: belongs to --frames",
        "--fps 24": "--fps: belongs to --frames",
        f"--frames 0 {_LIGHT}": "expected a whole number from 1",
    },
    _FRAMES: {
        "--animate spp=1": "expected KEY=FROM:TO",
        "--animate spp=a:b": "expected numbers",
        "--animate spp=1,2:3": "as many before as after",
        "--animate spp=nan:1": "expected numbers",
        f"{_LIGHT} -D spp=1": "leave -D spp=1 out",
        f"{_LIGHT} --turn spp": "'spp' is set more than once",
        f"{_LIGHT} --fps 3": "--fps: is for a film",
        f"{_LIGHT} -o a.avi": "a film ending in .webp or .gif or .mp4",
    },
}


@pytest.fixture(scope="module")
def folder(original: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small inputs of every kind, some of them damaged."""
    folder = tmp_path_factory.mktemp("refusals")
    for file in original.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    plate_file(folder)
    texts = {
        "room.xml": room.SCENE,
        "dull.xml": room.SCENE,
        "sky.xml": _SKY.format("empty.exr"),
        "skyless.xml": _SKY.format("missing.exr"),
        "line.obj": "v 0 0 0\nv 1 0 0\nv 2 0 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n",
        **{f"words.{suffix}": "words" for suffix in ("exr", "npy", "ply", "stl")},
        "empty.ply": "",
        "ply.ply": "ply",
        "a.sxm": ":NANONIS_VERSION:\n2\n",
        "measured.csv": "wl,R\n800,0.1\n900,0.2\n",
        "wrong.toml": 'generator = "sinusoidal"\noutput = "a.exr"\ntolerance = 2\n'
        "[arguments]\nperiod = 1.0\ndepth = 0.1\n",
        "long.toml": f"pixel_size = {30 * '9'}\n",
        "digits.toml": f"repeat = {5000 * '9'}\n",
        "groove.toml": 'method = "solved"\nprofile = "sinusoidal"\nmaterial = "none"\n'
        'output = "groove.nc"\n[arguments]\nperiod = 0.5\ndepth = 0.05\n',
    }
    for name, content in DAMAGED.items():
        (folder / f"{name}.exr").write_bytes(content)
    for name, text in texts.items():
        (folder / name).write_text(text)
    write_board(folder / "bare.obj", with_uv=False)
    for name in ("empty", "folder.exr", "folder.html"):
        (folder / name).mkdir()
    (folder / "parent" / "sub").mkdir(parents=True)
    (folder / "parent" / "sub" / "scan.npy").touch()
    (folder / "empty.npy").touch()
    (folder / "cut.npy").write_bytes(b"\x93NUMPY\x01\x00")
    x = np.arange(75) * 0.08
    grating = np.tile(0.02 * np.sin(2 * np.pi * x / 3.0), (75, 1))
    np.save(folder / "grating.npy", grating)
    np.save(folder / "nm.npy", 1e4 * grating)
    np.save(folder / "noise.npy", np.random.default_rng(1).normal(0.0, 0.02, (64, 64)))
    Image.new("RGB", (9, 9), "red").save(folder / "red.png")
    OpenEXR.File({}, {"height": np.zeros((4, 4), np.float32)}).write(str(folder / "depth.exr"))
    return folder


def rows(table: dict[str, dict[str, str]]) -> list[object]:
    """A case of each row; commands that set a variant together, as a change takes 0.1 s."""
    lines = [
        (f"{command} {words}", said, f"{command.split()[0]} {words}")
        for command, refusals in table.items()
        for words, said in refusals.items()
    ]
    lines.sort(key=lambda row: row[0].partition("-m ")[2].partition(" ")[0])
    return [pytest.param(line, said, id=name) for line, said, name in lines]


def contents() -> set[str]:
    """Names of all in the current folder."""
    return {str(path) for path in Path().rglob("*")}


@pytest.mark.parametrize(("line", "said"), rows(REFUSED))
def test_what_does_not_fit_is_one_line(run, folder, monkeypatch, request, line, said):
    if "-m " not in line:  # such a command sets its own
        request.getfixturevalue("some_variant")
    monkeypatch.chdir(folder)
    before = contents()
    assert said in run(*shlex.split(line)).failed_in_one_line()
    assert contents() == before


@pytest.mark.parametrize(("line", "said"), rows(USAGE))
def test_wrong_usage_is_one_line_with_the_name_of_the_command(run, folder, monkeypatch, line, said):
    monkeypatch.chdir(folder)
    before = contents()
    ran = run(*shlex.split(line))
    assert (ran.code, ran.out) == (2, "")
    (last,) = ran.err.splitlines()
    assert last.startswith(f"mitsuba-diffraction {line.split()[0]}: error: ")
    assert said in last
    assert contents() == before
