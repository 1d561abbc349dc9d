"""A fuzz of outputs against inputs: no command replaces a file that it reads."""

from __future__ import annotations

import itertools
import os
import shlex
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mitsuba_diffraction.cli.main import build_parser
from tests.support.inputs import HEIGHTS, NAMED, RENDER, SMALL

pytestmark = pytest.mark.thorough

#: A command with each kind of input, and the suffixes of its outputs.
COMMANDS = [
    (RENDER, ".exr .png"), (f"{RENDER} --assign ball=t.exr", ".exr"),
    (f"{RENDER} --assign ball=orders.nc", ".exr"),
    ("render mesh.ply --patch t.exr -m scalar_rgb -s 1 -D resx=4 -D resy=3", ".exr .png"),
    (f"{RENDER} --plan recipe.toml", ".exr"), (f"{RENDER} --frames 1 --turn width", ""),
    ("plan scale.xml --paths 64", ".toml"),
    ("brdf-map recipe.toml --resolution 8 --samples 1 --step 50", ".exr .png"),
    ("brdf-map t.exr --resolution 8 --samples 1 --step 50 --pigment pigment.csv "
     "--material keratin", ".exr .png"),
    ("brdf-map t.exr --resolution 8 --samples 1 --step 50 --layers layers.toml", ".exr"),
    ("evaluate recipe.toml --positions 0 --step 50 --angle-step 5", ".png .csv .npz"),
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
    ("scatter h.npy --pixel-size 0.1 --coherence-width 2", ".csv .png"),
    ("survey recipe.toml --resolution 8 -m llvm_ad_rgb", ""),
    ("export-osl t.exr --name t --material Al", ""),
    ("solve profile.txt --period 0.6 --theta 0 --wavelength-range 500:500 --material Al", ".nc"),
]  # fmt: skip
#: Commands that take long, and are refused before their work: test_outputs.py.
SLOW = {"compare", "tradeoff", "export-viewer", "view"}
#: Commands without a file as their output.
NONE = {"info", "presets"}


@pytest.mark.parametrize(("command", "suffixes"), COMMANDS, ids=lambda text: text[:40])
def test_no_output_of_any_name_replaces_an_input(
    run, original, world, command, suffixes, monkeypatch
):
    """Outputs called after each input, with every suffix, in several spellings; then defaults."""
    # a process for each `solve` would take longer to start than to solve
    monkeypatch.setattr("mitsuba_diffraction.orders.solve.jobs.processes", ThreadPoolExecutor)
    first, inputs = _inputs(world, command)
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
    for name in sorted(inputs):
        check("--json", next(spellings).format(name))
    # what the command makes by default are links to an input in the next run
    made = check()
    for name, link in zip(made, itertools.cycle([os.link, os.symlink]), strict=False):
        (world / name).parent.mkdir(parents=True, exist_ok=True)
        link(world / first, world / name)
    run(*shlex.split(command))
    for name in made:
        assert (world / name).samefile(world / first), name
    check()


def test_every_command_is_tried():
    parsers = next(a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    tried = {command.split()[0] for command, _ in COMMANDS}
    assert isinstance(parsers, dict)
    assert tried == {*parsers} - NONE - SLOW


def _inputs(world: Path, command: str) -> tuple[str, set[str]]:
    """Return the first file that a command reads, and all of them."""
    words = [word for part in shlex.split(command) for word in part.replace("=", ",").split(",")]
    read = [word for word in words if (world / word).exists()]
    return read[0], {name for word in read for name in (word, *NAMED.get(word, ()))}
