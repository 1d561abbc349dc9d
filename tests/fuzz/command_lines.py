"""Random command lines: an exit code, at most a few lines on stderr, and never a traceback."""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mitsuba_diffraction.cli import build_parser, main
from tests.fuzz.damage import originals

#: Take minutes at their smallest, or open a window.
_LEFT_OUT = {"tradeoff", "view"}
_LINES, _CHARACTERS = 30, 560
_VALUES = (
    "0", "1", "-1", "0.5", "3", "1e-3", "550", "400", "700", "1e300", "-1e300", "nan", "inf", "abc",
    "", " ", "x" * 3000, "é", "a=b", "resx=4", "none", "Al", "1.5", "out.png", "out.exr", "out.ply",
    "out.json", "out.html", "missing/out.exr", "fast", "spectral", "flss", "pq", "plane", "smooth",
    "harmonic", "10,20", "0:90", "scalar_rgb", "scalar_spectral",
)  # fmt: skip
_SCENE = """<scene version="3.0.0"><default name="resx" value="6"/>
<integrator type="path"/><sensor type="perspective"><film type="hdrfilm">
<integer name="width" value="$resx"/><integer name="height" value="4"/></film>
<sampler type="independent"><integer name="sample_count" value="1"/></sampler></sensor>
<shape type="sphere"><bsdf type="diffraction"><string name="filename" value="ensemble.exr"/></bsdf>
</shape><emitter type="point"><point name="position" value="0,0,-4"/></emitter></scene>
"""
# what would take long otherwise; an option that comes again counts
_SMALL = {
    "brdf-map": ["--resolution", "8", "--samples", "1"],
    "sweep": ["--resolution", "8"],
    "evaluate": ["--positions", "0"],
    "render": ["-m", "scalar_rgb", "-s", "1"],
    "compare": ["-m", "scalar_rgb"],
    "export-viewer": ["-m", "scalar_rgb"],
}


@functools.cache
def options() -> dict[str, list[argparse.Action]]:
    """The arguments of every command."""
    actions = build_parser()._actions
    commands = next(a.choices for a in actions if isinstance(a.choices, dict))
    return {
        name: [a for a in parser._actions if not isinstance(a, argparse._HelpAction)]
        for name, parser in commands.items()
        if name not in _LEFT_OUT
    }


def command_line(rng: np.random.Generator) -> list[str]:
    """A command with some of its options, and values that may suit them."""
    name = str(rng.choice(sorted(options())))
    files = [*sorted(originals()), "scene.xml", "missing.exr", "."]
    words = [name]
    for action in options()[name]:
        if action.option_strings and rng.random() > 0.15:
            continue
        if action.option_strings:
            words.append(str(rng.choice(action.option_strings)))
        if action.nargs != 0:
            count = action.nargs if isinstance(action.nargs, int) else 1
            for _ in range(count if rng.random() < 0.97 else count - 1):
                words.append(_value(rng, action, files))
    small = _SMALL.get(name, []) + (["--no-compiled"] if words[:2] == ["sweep", "method"] else [])
    return words + (small if rng.random() < 0.98 else [])


def _value(rng: np.random.Generator, action: argparse.Action, files: list[str]) -> str:
    if action.choices and rng.random() < 0.8:
        return str(rng.choice(sorted(map(str, action.choices))))
    if not action.option_strings and rng.random() < 0.9:
        named = [f for f in files if action.dest != "scene" or f.endswith(".xml")]
        return str(rng.choice(named))
    return str(rng.choice(_VALUES))


def check(rng: np.random.Generator) -> None:
    """Run it in a folder with small files."""
    words = command_line(rng)
    stdout, stderr = io.StringIO(), io.StringIO()
    with _folder(), contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
        code = main([*words])
    shown = " ".join(word[:40] for word in words)
    said = stderr.getvalue()
    assert code in (0, 1, 2), f"{shown}: exit code {code}"
    assert "Traceback" not in said or "--debug" in words, f"{shown}: a traceback"
    assert "unexpected" not in said, f"{shown}: {said[-300:]}"
    # a bar is drawn anew in its line
    lines = [line.rsplit("\r", 1)[-1] for line in said.rstrip("\n").split("\n")]
    assert len(lines) <= _LINES or code == 2 or "--debug" in words, f"{shown}: {len(lines)} lines"
    if code == 1:
        assert len(lines[-1]) <= _CHARACTERS, f"{shown}: {len(lines[-1])} characters"


@contextlib.contextmanager
def _folder() -> Iterator[None]:
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        for name, content in originals().items():
            Path(folder, name).write_bytes(content)
        Path(folder, "scene.xml").write_text(_SCENE)
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)
