"""`view`, `compare`, `export-viewer`, `export-shader`: scenes and surfaces drawn by shaders."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from ..errors import DiffractionError, counted
from ..realtime.glsl.methods import METHODS, WEB_METHODS
from ..scene import load_scene, set_variant
from ..scene.load import sensor_of
from ..thesis import shaders  # noqa: F401 - registers its methods
from . import options, scene_options
from .brdf_map import SURFACE_SOURCE, surface_bsdf, surface_options, take_source
from .console import Bar, say, say_warning
from .report import Figures, check_outputs, elapsed, output_of, plain, save_json
from .values import STOPS, path_ending_in, whole_number

_EXPORTED = ("fast", "exact")


@options.command(
    "view", "look at a scene in the browser, in real time",
    "Write the page of a scene, as export-viewer does, and open it in the browser: orbit, pan, "
    "zoom, drag the light, change method, exposure and material.",
    *scene_options.SCENE,
    ("--method", "method to start with", WEB_METHODS, "fast"),
    ("--exposure EV", "stops to start with: +1 doubles the light", STOPS, 0.0),
    options.VIEW,
    ("-o --output OUT", "page to write; default: one in the system's folder of temporary files",
     path_ending_in(".html")),
)  # fmt: skip
def view(args: argparse.Namespace) -> Figures:
    """Write the page, open it, and return its figures."""
    scene_options.put_on_stage(args)
    with contextlib.ExitStack() as failed:
        if args.output is None:
            folder = Path(tempfile.mkdtemp(prefix="mitsuba-diffraction-"))
            failed.callback(folder.rmdir)
            args.output = folder / f"{args.name.stem}.html"
        figures = _write_page(args, WEB_METHODS)
        failed.pop_all()
    start = {"method": args.method, "exposure": args.exposure}
    if args.method in figures["left_out"]:
        raise DiffractionError(f"method {args.method}: {figures['left_out'][args.method]}")
    # without a need for it no fragment: some systems open files without
    started = args.method != WEB_METHODS[0] or args.exposure != 0.0
    address = args.output.resolve().as_uri() + (f"#{urlencode(start)}" if started else "")
    if not _opened(address):
        print(f"no browser is here; open {address} in one with WebGL 2")
    return figures


def _opened(address: str) -> bool:
    """Open a page in a browser with windows; return whether there is one."""
    shown = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    if sys.platform == "linux" and not any(os.environ.get(name) for name in shown):
        return False  # a browser in the terminal draws no pictures
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False


@options.command(
    "compare", "compare the realtime picture of a scene with the path-traced one",
    "Render a scene by shaders and by path tracing, aligned to the pixel, and measure the "
    "difference: over all pixels in all direct light of the scene, and beside it in full "
    "transport.",
    *scene_options.SCENE,
    ("-o --output FOLDER", "for pictures (EXR), sheets (PNG) and compare.json; default: the "
     "scene's name with _compare in the current folder", Path),
    ("--method NAME ...", f"methods of the shaders: {', '.join(METHODS)}, or all; default: "
     "fast", (*METHODS, "all"), ["fast"]),
    *options.samples(2, 1024),
    ("--full-spp N", "samples per pixel of full transport; 0 leaves it out",
     whole_number(0), 64),
    ("--frames N", "frames of progressive light", whole_number(4), 512),
    ("--supersampling N", "the shaders' samples along either side of a pixel", whole_number(1), 8),
    options.json(),
)  # fmt: skip
def compare(args: argparse.Namespace) -> Figures:
    """Compare, and return the figures."""
    scene_options.put_on_stage(args)
    parameters = scene_options.scene_parameters(args)

    def files_in(folder: Path) -> list[Path]:
        return [folder / "compare.json", *folder.glob("*.exr"), *folder.glob("*.png")]

    folder = output_of(args, Path(f"{args.name.stem}_compare"), files_in, make_folder=True)

    from ..realtime.shader_comparison.report import markdown
    from ..realtime.shader_comparison.run import Comparison

    variant = _set_variant(args)
    every = "all" in args.method
    with Bar(args, delay=0) as bar:
        bar(0, 0, "loading")
        comparison = Comparison(
            _scene(args, parameters), str(args.scene), variant, folder, args.sensor, args.spp,
            args.full_spp, args.frames // 4 * 4, args.supersampling, args.seed, bar,
        )  # fmt: skip
        figures = comparison.run(tuple(METHODS) if every else args.method, leave_out=every)
    figures = {"scene": figures["scene"], "parameters": parameters, **figures}
    save_json(folder / "compare.json", figures)
    print(markdown(plain(figures)))
    print(f"{folder}: pictures, sheets and compare.json, {elapsed(args):.0f} s")
    return figures


@options.command(
    "export-viewer", "write a page that shows a scene in a browser, without a server",
    "Write one self-contained page of HTML, of at most 25 MB, that draws a scene with "
    "WebGL 2: orbit, pan, zoom, and drag the light. Tables are rounded to as many digits "
    "as fit; the resulting ΔE2000 is printed, and shown on the page.",
    *scene_options.SCENE,
    ("-o --output OUT", "page; default: the scene's name with .html in the current folder",
     path_ending_in(".html")),
    ("--method", "method on the page; all leaves out those that do not suit the scene",
     (*WEB_METHODS, "all"), "all"),
    options.VIEW,
    ("--title TEXT", "title of the page; default: the scene's name"),
    options.json("contents of the page"),
)  # fmt: skip
def export_viewer(args: argparse.Namespace) -> Figures:
    """Export, and return the figures."""
    scene_options.put_on_stage(args)
    args.output = output_of(args, Path(f"{args.name.stem}.html"))
    return _write_page(args, WEB_METHODS if args.method == "all" else (args.method,), args.title)


def _write_page(args: argparse.Namespace, methods: Sequence[str], title: str = "") -> Figures:
    """Write the page of a scene, and return the figures."""
    parameters = scene_options.scene_parameters(args)
    check_outputs([args.output])

    from ..realtime.web import export_viewer

    _set_variant(args)
    with Bar(args, delay=0) as bar:
        bar(0, 0, "loading")
        page = export_viewer(
            _scene(args, parameters), args.output, title=title or args.name.stem,
            sensor=args.sensor, view=args.view, progress=bar, methods=methods,
        )  # fmt: skip
    if page.omissions:
        say_warning(f"the page does not show: {'; '.join(dict.fromkeys(page.omissions))}")
    for method, reason in page.left_out.items():
        say_warning(f"the page goes without {method}: {reason}")
    losses = "; ".join(
        f"{method} ΔE2000 {mean:.2f} (99 % below {most:.2f})"
        for method, (mean, most) in page.loss.items()
    )
    size, seconds = args.output.stat().st_size, elapsed(args)
    print(f"{args.output}: {size / 1e6:.1f} MB, {seconds:.1f} s; rounding: {losses}")
    return {"scene": args.scene, "files": [args.output], "bytes": size,
            "delta_e": {m: {"mean": mean, "99 %": most}
                        for m, (mean, most) in page.loss.items()},
            "left_out": page.left_out, "omissions": page.omissions,
            "seconds": seconds}  # fmt: skip


@options.command(
    "export-shader",
    "write a surface's diffraction as GLSL with its textures, for other programs",
    "Write a function `vec3 diffraction(vec3 wi, vec3 wo)` in GLSL, its textures (EXR) and "
    "constants (JSON), and a material of three.js that uses them. How to bring it into "
    "another engine: docs/realtime.md.",
    *SURFACE_SOURCE,
    ("-o --output FOLDER", "to write into, made if it is missing; default: SOURCE's name with "
     "-shader in the current folder", Path),
    ("--method", "colours of daylight summed up beforehand, a loop over wavelengths, or both; "
     "default: both", _EXPORTED, _EXPORTED, {"nargs": "+"}),
    options.MODE,
    surface_options(turned=False),
    options.heights(),
    options.json("the files and their settings"),
)  # fmt: skip
def export_shader(args: argparse.Namespace) -> Figures:
    """Export, and return the figures."""
    take_source(args)

    def files_in(folder: Path) -> list[Path]:
        return [folder / "constants.json", folder / "diffraction.glsl", *folder.glob("*.exr")]

    folder = output_of(args, Path(f"{args.source.stem}-shader"), files_in, make_folder=True)

    from ..realtime.glsl.export import export_shader

    _set_variant(args)
    with Bar(args) as bar:
        bar(0, 0, "making tables")
        shader = export_shader(surface_bsdf(args), folder, list(dict.fromkeys(args.method)))
    files = [folder / "diffraction.glsl", *(folder / f"{t.name}.exr" for t in shader.textures)]
    code, *textures = (file.stat().st_size for file in files)
    print(
        f"{folder}: {', '.join(shader.functions.values())}: {code / 1e3:.1f} kB of GLSL, "
        f"{counted(len(textures), 'texture')} of {sum(textures) / 1e6:.1f} MB, "
        f"{elapsed(args):.1f} s; {shader.surface}"
    )
    return {"source": args.source, "folder": folder, "files": files,
            "functions": shader.functions, "surface": shader.surface,
            "bytes": {"code": code, "textures": sum(textures)}}  # fmt: skip


def _set_variant(args: argparse.Namespace) -> str:
    """Set the requested variant if shaders can read scenes in it, and return its name."""
    from ..realtime.glsl.scene import check_variant

    variant = set_variant(args.mode)
    check_variant(variant)
    return variant


def _scene(args: argparse.Namespace, parameters: dict[str, str]) -> Any:
    """Load the scene, and check that it has the requested sensor."""
    scene = load_scene(args.scene, parameters, say=say)
    sensor_of(scene, args.sensor)
    return scene
