"""Outputs never replace a file that the command reads: a given name is refused, a default changed.

`world` is a folder of small inputs; `COMMANDS` reads every one of them with every command.
"""

from __future__ import annotations

import itertools
import json
import os
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.cli.arguments import OUTPUTS
from mitsuba_diffraction.cli.main import build_parser
from tests.support.directions import rough_patch
from tests.support.orders import thin_grating
from tests.support.systems import posix

SCENE = """<scene version="3.0.0"><default name="width" value="4"/>
<include filename="light.xml"/><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="$width"/>
<integer name="height" value="4"/></film><sampler type="independent">
<integer name="sample_count" value="1"/></sampler></sensor>
<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
<string name="filename" value="scale.png"/></texture></bsdf></shape>
<shape type="ply"><string name="filename" value="mesh.ply"/></shape>
<shape type="sphere" id="ball"><bsdf type="diffraction" id="skin">
<string name="heightfield" value="recipe.toml"/><string name="material" value="Al"/></bsdf></shape>
</scene>"""
LIGHT = """<scene version="3.0.0"><emitter type="envmap">
<string name="filename" value="sky.exr"/></emitter></scene>"""
PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""
SMALL = "--coherence-width 2 --tolerance 0.05"


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """Small inputs of every kind."""
    folder = tmp_path_factory.mktemp("original")
    field = rough_patch((20, 24), (0.1, 0.1), 0.05)
    np.save(folder / "h.npy", field.heights)
    grey = np.uint8(255 * (field.heights - field.heights.min()) / np.ptp(field.heights))
    Image.fromarray(grey).save(folder / "scale.png")
    Image.fromarray(np.stack([grey > 127] * 3, -1).astype(np.uint8) * 255).save(folder / "logo.png")
    DiffractionTable.build(field, coherence_width=2.0, tolerance=0.05).save(folder / "t.exr")
    thin_grating().save(folder / "orders.nc")
    texts = {
        "scale.xml": SCENE, "light.xml": LIGHT, "mesh.ply": PLY,
        "recipe.toml": 'source = "h.npy"\npixel_size = 0.1\ncoherence_width = 2\n'
        "tolerance = 0.05\n",
        "pigment.csv": "400,0.2\n700,0.4\n", "profile.txt": "0 0\n0.3 0.05\n0.6 0\n",
        "layers.toml": '[[layer]]\nmaterial = "SiO2"\nthickness = 0.1\n',
        "treatments.toml": '["*.npy"]\npixel_size = 0.1\n',
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    import OpenEXR

    OpenEXR.File({}, {"RGB": np.ones((2, 4, 3), np.float32)}).write(str(folder / "sky.exr"))
    return folder


@pytest.fixture
def world(original, here):
    """A copy of the small inputs, which is the current folder."""
    shutil.copytree(original, here, dirs_exist_ok=True)
    return here


def _contents(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {f.name: (f.stat().st_ino, f.read_bytes()) for f in folder.iterdir() if f.is_file()}


RENDER = "render scale.xml -m scalar_rgb -s 1"
HEIGHTS = f"--pixel-size 0.1 {SMALL}"


@pytest.mark.parametrize(
    "command",
    [
        f"{RENDER} -o scale.png", f"{RENDER} -o scale.exr", f"{RENDER} -o sky.exr",
        f"{RENDER} -o ../here/sky.exr", f"{RENDER} --frames 2 --turn width -o frames",
        f"{RENDER} --material ball=t.exr -o t.exr",
        f"{RENDER} --preset ball=cd,pigment=sky.exr -o sky.exr",
        "brdf-map recipe.toml -o h.exr", "evaluate recipe.toml -o h.png",
        "spectrum recipe.toml -o pigment.csv --pigment pigment.csv",
        f"spectrum h.npy {HEIGHTS} -o h.csv",
        "plan scale.xml -o recipe.toml", "tangents mesh.ply -o mesh.ply",
        "precompute recipe.toml -o h.exr", f"precompute t.exr {HEIGHTS} -o t.exr",
        "solve profile.txt --period 0.6 -o profile.nc", "orders orders.nc -o orders.csv",
        "tonemap sky.exr -o sky.png", f"export-bsdf h.npy {HEIGHTS} -o h.bsdf",
        f"export-shader h.npy {HEIGHTS} -o folder",
        f"export-osl h.npy {HEIGHTS} -o folder --name a",
        "export-viewer scale.xml page.html -m scalar_rgb", "compare scale.xml -o folder",
        "hologram logo.png -o folder", f"survey h.npy {HEIGHTS} -o folder",
        f"sweep method h.npy {HEIGHTS} -o h.png", "tradeoff h.npy --pixel-size 0.1 -o folder",
    ],
)  # fmt: skip
def test_a_given_output_over_an_input_is_refused_before_the_work(run, world, command):
    """Where the output's name is not an input's, the input is a link of that name."""
    beside = {
        "scale.exr": "t.exr", "h.exr": "h.npy", "h.png": "h.npy", "h.csv": "h.npy",
        "profile.nc": "profile.txt", "orders.csv": "orders.nc", "sky.png": "sky.exr",
        "h.bsdf": "h.npy", "page.html": "sky.exr",
        "frames/frame_0001.png": "scale.png", "folder/diffraction.glsl": "h.npy",
        "folder/a.osl": "h.npy", "folder/compare.json": "sky.exr", "folder/ring.xml": "logo.png",
        "folder/samples.csv": "h.npy", "folder/depth.png": "h.npy",
    }  # fmt: skip
    for name, source in beside.items():
        if name.split("/")[0] in command and not Path(name).exists():
            Path(name).parent.mkdir(exist_ok=True)
            os.link(source, name)
    before = _contents(world)
    assert "would overwrite" in run(*shlex.split(command)).failed_in_one_line()
    assert _contents(world) == before


def test_a_default_output_over_an_input_gets_another_name_in_one_line(run, world):
    """The scene reads scale.png, which is where its picture would go."""
    before = _contents(world)
    ran = run(*shlex.split(RENDER))
    assert ran.code == 0, ran.err
    said = [line for line in ran.err.splitlines() if "reads" in line]
    assert said == [
        "mitsuba-diffraction: this command reads 'scale.png', so its output is called 'scale-2.exr'"
    ]
    after = _contents(world)
    assert {"scale-2.exr", "scale-2.png"} == {*after} - {*before}
    assert all(after[name] == content for name, content in before.items())


@posix
@pytest.mark.parametrize("link", [os.link, os.symlink], ids=["hard", "symbolic"])
def test_links_to_an_input_are_that_input(run, world, link):
    link(world / "mesh.ply", world / "other.ply")
    for pair in itertools.permutations(["mesh.ply", "other.ply"]):
        line = run("tangents", pair[0], "-o", pair[1]).failed_in_one_line()
        assert "would overwrite" in line
    assert (world / "mesh.ply").read_text() == PLY


def test_pictures_and_buffers_beside_a_gltf_are_inputs(run, world):
    document = {"asset": {"version": "2.0"}, "images": [{"uri": "a%20b.png"}],
                "buffers": [{"uri": "m.bin", "byteLength": 4}]}  # fmt: skip
    Path("m.gltf").write_text(json.dumps(document))
    shutil.copy("scale.png", "a b.png")
    line = run("render", "m.gltf", "--preset", "cd", "-o", "a b.png").failed_in_one_line()
    assert "would overwrite 'a b.png'" in line


@posix
@pytest.mark.parametrize("name", ["pipe.png", "null.png"])
def test_a_pipe_or_a_device_as_output_is_refused(run, world, name):
    os.mkfifo("pipe.png")
    os.symlink(os.devnull, "null.png")
    line = run(*shlex.split(RENDER), "-o", name).failed_in_one_line()
    assert "pipe or a device" in line
    assert Path(name).exists()


def test_the_library_may_replace_what_it_has_read(world):
    before = Path("t.exr").read_bytes()
    DiffractionTable.load("t.exr").save("t.exr")
    assert Path("t.exr").read_bytes() == before


def test_every_option_that_names_an_output_is_known():
    """An output that counted as an input would be refused the second time."""
    parsers = next(a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    assert isinstance(parsers, dict)
    named = {
        action.dest for parser in parsers.values() for action in parser._actions
        if str(action.help).startswith("write") and action.metavar
    }  # fmt: skip
    assert named <= {*OUTPUTS}


#: A command with each kind of input, and the suffixes of its outputs.
COMMANDS = [
    (RENDER, ".exr .png"), (f"{RENDER} --material ball=t.exr", ".exr .png"),
    (f"{RENDER} --material ball=orders.nc", ".exr"),
    ("render mesh.ply --patch t.exr -m scalar_rgb -s 1 -D resx=4 -D resy=3", ".exr .png"),
    (f"{RENDER} --plan recipe.toml", ".exr"), (f"{RENDER} --frames 1 --turn width", ""),
    ("plan scale.xml --paths 64", ".toml"), ("brdf-map recipe.toml --resolution 8", ".exr .png"),
    ("brdf-map t.exr --resolution 8 --samples 1 --step 50 --pigment pigment.csv "
     "--material keratin", ".exr .png"),
    ("brdf-map t.exr --resolution 8 --samples 1 --step 50 --layers layers.toml", ".exr"),
    ("evaluate recipe.toml --windows 0 --step 50 --angle-step 5", ".png .csv .npz"),
    ("spectrum t.exr --material keratin --pigment pigment.csv --step 50", ".csv .png"),
    ("spectrum recipe.toml --step 100", ".csv .png"), ("spectrum orders.nc --step 100", ".csv"),
    ("spectrum h.npy --treatments treatments.toml --step 100 " + SMALL, ".csv"),
    ("tangents mesh.ply", ".ply"), ("precompute recipe.toml", ".exr"),
    (f"precompute h.npy {HEIGHTS}", ".exr"),
    (f"precompute scale.png {HEIGHTS} --max-height 0.1", ".exr"),
    ("orders orders.nc --theta 0 --wavelength 500", ".csv"), ("tonemap sky.exr", ".png"),
    (f"sweep light-angle h.npy {HEIGHTS} --resolution 8 --step 100", ".png .csv"),
    ("export-bsdf t.exr --theta 0 --wavelength 550 --resolution 8 --format bird", ".json .brdf"),
    ("export-shader t.exr --method fast -m scalar_rgb", ""), ("hologram logo.png", ""),
    ("survey recipe.toml --resolution 8 -m llvm_ad_rgb", ""),
    ("solve profile.txt --period 0.6 --resolution 80 --tolerance 0.2 --wavelength-range 590,610",
     ".nc"),
]  # fmt: skip


#: What files name.
NAMED = {
    "scale.xml": ("light.xml", "sky.exr", "scale.png", "mesh.ply", "recipe.toml", "h.npy"),
    "recipe.toml": ("h.npy",),
}  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize(("command", "suffixes"), COMMANDS, ids=lambda text: text[:40])
def test_no_output_of_any_name_replaces_an_input(run, original, world, command, suffixes):
    """Outputs called after each input, with every suffix, in several spellings; then defaults."""
    words = [word for part in shlex.split(command) for word in part.replace("=", ",").split(",")]
    first, *others = (word for word in words if (world / word).exists())
    inputs = {name for word in (first, *others) for name in (word, *NAMED.get(word, ()))}
    before = {name: (original / name).read_bytes() for name in inputs}

    def check(*options: str) -> list[str]:
        """Run the command, check its inputs, and tidy up; the names of what it has made."""
        run(*shlex.split(command), *options)
        assert {name: (world / name).read_bytes() for name in inputs} == before, options
        made = [str(f.relative_to(world)) for f in world.rglob("*") if f.is_file()]
        shutil.rmtree(world)
        shutil.copytree(original, world)
        os.chdir(world)
        return [name for name in made if not (world / name).exists()]

    spellings = itertools.cycle(["{}", "../here/./{}"])
    for name, suffix in itertools.product(sorted(inputs), suffixes.split()):
        check("-o", next(spellings).format(f"{Path(name).stem}{suffix}"))
    # what the command makes by default are links to an input in the next run
    made = check()
    for name, link in zip(made, itertools.cycle([os.link, os.symlink]), strict=False):
        (world / name).parent.mkdir(parents=True, exist_ok=True)
        link(world / first, world / name)
    run(*shlex.split(command))
    for name in made:
        assert (world / name).samefile(world / first), name
    check()
