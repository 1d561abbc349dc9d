"""Files that run or leak something if a program trusts the folder that they lie in."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.plugin import installed
from mitsuba_diffraction.scene.orientation import TriangleMesh, write_ply
from tests.support import ROOT
from tests.support.command_line import Ran
from tests.support.small_files import gltf

_SOURCE = """
#include <stdio.h>
__attribute__((constructor)) static void run(void) {
    FILE *file = fopen(MARK, "w");
    if (file) fclose(file);
}
"""


def plugins_in(folder: Path, mark: Path, names: Iterable[str]) -> Path:
    """Write plugins/NAME.so that create the file `mark` when they are loaded; return `mark`."""
    built = _library(mark)
    (folder / "plugins").mkdir(exist_ok=True)
    for name in names:
        shutil.copy(built, folder / "plugins" / f"{name}.so")
    return mark


def other_metals(folder: Path) -> None:
    """Write tables of optical constants, those of a vacuum, where Mitsuba looks for them."""
    tables = folder / "data" / "ior"
    tables.mkdir(parents=True)
    for name, value in (("eta", 1.0), ("k", 0.0)):
        for metal in ("Al", "Unobtainium"):
            (tables / f"{metal}.{name}.spd").write_text(f"300 {value}\n900 {value}\n")


def _library(mark: Path) -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler is installed, to build a library that tells of being loaded")
    source, built = mark.with_suffix(".c"), mark.with_suffix(".so")
    source.write_text(_SOURCE)
    subprocess.run(
        [compiler, "-shared", "-fPIC", f'-DMARK="{mark}"', "-o", built, source], check=True
    )
    return built


def postscript(file: Path) -> Path:
    """Write an image in PostScript (EPS), a program that Ghostscript runs; return the file."""
    Image.new("L", (8, 8)).save(file, format="EPS")
    return file


#: Text of a file outside of the folder, which nothing may print.
PRIVATE = "PRIVATE"
#: Suffixes of pipes that scenes name.
PIPES = ("xml", "png", "npy", "csv", "toml", "nc")
_BENIGN = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="6"/>
<integer name="height" value="4"/></film><sampler type="independent">
<integer name="sample_count" value="1"/></sampler>
<transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform></sensor>
<emitter type="point"><point name="position" value="0,0,4"/></emitter>
<shape type="sphere"><bsdf type="diffraction"><string name="filename" value="heights.npy"/>
<float name="pixel_size" value="0.08"/><float name="coherence_width" value="4"/></bsdf></shape>
<shape type="ply"><string name="filename" value="mesh.ply"/>
<bsdf type="conductor"><string name="material" value="Al"/></bsdf></shape>{}</scene>
"""
_SHAPE = '<shape type="sphere">{}</shape>'
#: What a scene of somebody else may have in addition; tests/scene/test_parameters.py has includes.
SCENES = {
    "plugin": _SHAPE.format('<bsdf type="unheard_of"/>'),
    "above": _SHAPE.format('<bsdf type="../outside"/>'),
    "chosen": '<default name="a" value="unheard_of"/>' + _SHAPE.format('<bsdf type="$a"/>'),
    "blender": '<shape type="blender"><integer name="verts" value="8"/></shape>',
    "picture": _SHAPE.format(
        '<bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
        '<string name="filename" value="pipe.png"/></texture></bsdf>'
    ),
    "spectrum": _SHAPE.format(
        '<bsdf type="diffuse"><spectrum name="reflectance" filename="pipe.csv"/></bsdf>'
    ),
    "table": _SHAPE.format(
        '<bsdf type="diffraction_orders"><string name="filename" value="pipe.nc"/></bsdf>'
    ),
    "layers": _SHAPE.format(
        '<bsdf type="diffraction"><string name="filename" value="heights.npy"/>'
        '<float name="pixel_size" value="0.08"/><string name="layers" value="pipe.toml"/></bsdf>'
    ),
}


class Folder(NamedTuple):
    """A folder from somebody else.

    Attributes
    ----------
    path : the folder.
    mark : file that exists once something in the folder has run.
    private : files beside the folder.
    programs : folder with a program `gs`, which creates `mark`, too.
    """

    path: Path
    mark: Path
    private: list[Path]
    programs: Path


def hostile_folder(root: Path) -> Folder:
    """Write files that look like those of a scene, and others that run or leak something."""
    path, mark, programs = root / "scene", root / "ran", root / "programs"
    path.mkdir()
    (path / "out").mkdir()
    names = {file.stem for file in (installed.folder() / "plugins").iterdir()}
    plugins_in(path, mark, [*names, *installed.REGISTERED, "unheard_of", "fitted_mesh"])
    shutil.copy(mark.with_suffix(".so"), path / "outside.so")
    other_metals(path)
    private = [root / name for name in ("private.xml", "id_rsa", "private.exr", "private.osl")]
    for file in private:
        file.write_text(f'<scene version="3.0.0"><!-- {PRIVATE} --><{PRIVATE}/></scene>')
    programs.mkdir()
    for name in ("gs", "latex"):
        (programs / name).write_text(f"#!/bin/sh\ntouch {mark}\n")
        (programs / name).chmod(0o755)
    run_python = f"open({str(mark)!r}, 'w')\n"
    for name in ("numpy", "matplotlib", "mitsuba", "sitecustomize", "evil_backend"):
        (path / f"{name}.py").write_text(run_python)
    (path / "matplotlibrc").write_text("text.usetex: True\nbackend: module://evil_backend\n")

    np.save(path / "heights.npy", np.tile(0.02 * np.sin(np.pi * np.arange(60) / 10), (60, 1)))
    write_ply(path / "mesh.ply", _square())
    Image.effect_noise((24, 24), 90).point(lambda x: 255 * (x > 128)).save(path / "logo.png")
    postscript(path / "postscript.png")
    for suffix in PIPES:
        os.mkfifo(path / f"pipe.{suffix}")
    (path / "scene.xml").write_text(_BENIGN.format(""))
    for name, content in SCENES.items():
        (path / f"{name}.xml").write_text(_BENIGN.format(content))
    _exported(path / "exported", "private.exr", root)
    elsewhere = gltf(buffers=[{"uri": "../private.exr", "byteLength": 42}])
    (path / "mesh.gltf").write_text(json.dumps(elsewhere))
    return Folder(path, mark, private, programs)


def _exported(folder: Path, secret: str, root: Path) -> None:
    """Write an exported shader whose document names files elsewhere."""
    folder.mkdir()
    (folder / "shader.osl").write_text("shader a() {}")
    (folder / "link.exr").symlink_to(root / secret)
    inputs = [{"identifier": "a", "label": "a"}]
    document = {
        "shader": "shader.osl", "inputs": inputs,
        "textures": {"a": f"../../{secret}", "b": str(root / "id_rsa"), "c": "link.exr"},
    }  # fmt: skip
    (folder / "shader.json").write_text(json.dumps(document))


def _square() -> TriangleMesh:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    positions = np.column_stack([corners, np.zeros(4)])
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    return TriangleMesh(positions, normals, corners, np.array([[0, 1, 2], [0, 2, 3]]))


# Each group runs in a copy of a process that has only imported the package and SciPy: what Mitsuba
# has loaded once, it loads no more.
_RUNNER = """
import json, os, signal, sys
import scipy.interpolate, scipy.ndimage, scipy.spatial
from mitsuba_diffraction.cli import main
from pytest import MonkeyPatch
from tests.support.coarse import coarse_energy, little_light
from tests.support.kernels import compile_quickly

coarse_energy()
compile_quickly()
little_light(MonkeyPatch().setattr)

def run(group, names):
    if process := os.fork():
        os.waitpid(process, 0)
        return
    for words, name in zip(group, names):
        signal.alarm(600)  # of a busy machine; a pipe that is read waits for ever
        for descriptor, kind in enumerate(("out", "err"), 1):
            os.dup2(os.open(f"{name}.{kind}", os.O_WRONLY | os.O_CREAT), descriptor)
        try:
            code = main(words)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
        open(f"{name}.code", "w").write(str(code))
    os._exit(0)

# `solve` starts processes, which import this file
if __name__ == "__main__":
    for n, group in enumerate(json.load(open(sys.argv[1]))):
        run(group, [os.path.join(sys.argv[2], f"{n}.{k}") for k in range(len(group))])
"""


def run_in(folder: Folder, groups: Sequence[Sequence[Sequence[str]]]) -> list[Ran]:
    """Run commands in the folder, each group in a process of its own, and return their results."""
    work = folder.path.parent / "run"
    work.mkdir()
    (work / "run.py").write_text(_RUNNER)
    (work / "commands.json").write_text(json.dumps(groups))
    subprocess.run(
        [sys.executable, work / "run.py", work / "commands.json", work],
        cwd=folder.path,
        env={
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PATH": f"{folder.programs}{os.pathsep}{os.environ['PATH']}",
        },
        check=True,
    )
    names = [work / f"{n}.{k}" for n, group in enumerate(groups) for k in range(len(group))]

    def read(name: Path, kind: str, missing: str) -> str:
        file = name.with_name(f"{name.name}.{kind}")
        return file.read_text() if file.exists() else missing

    return [Ran(int(read(n, "code", "70")), read(n, "out", ""), read(n, "err", "")) for n in names]
