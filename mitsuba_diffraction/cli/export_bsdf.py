"""`export-bsdf`: a surface's BRDF as a file for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DiffractionError, counted
from ..scene import set_variant
from . import options
from .brdf_map import SURFACE_SOURCE, surface_bsdf, surface_options, take_source
from .console import Bar
from .report import Figures, elapsed, output_of
from .values import numbers, path_ending_in, whole_number

# Formats, and the suffixes of their files; the first format of a suffix is the default.
_SUFFIXES = {
    "rgl": (".bsdf",), "zemax": (".bsdf",), "bird": (".json", ".brdf"), "csv": (".csv",),
}  # fmt: skip


@options.command(
    "export-bsdf", "write a surface's BRDF for other programs",
    "Write the reflected light on a grid of directions, for programs that have no diffraction: "
    "rgl for Mitsuba's 'measured', zemax for OpticStudio's tabular BSDF, bird for the JSON of "
    "the BiRD project, csv for lines of scatter in 1/sr. Lobes narrower than the grid "
    "become as wide as it, with all their light.",
    *SURFACE_SOURCE,
    ("-o --output OUT", "the file; default: SOURCE's name with .bsdf in the current folder",
     path_ending_in(".bsdf", ".json", ".brdf", ".csv")),
    options.MODE,
    options.Group("the file", (
        ("--format", "default: rgl for .bsdf, bird for .json and .brdf, csv for .csv",
         tuple(_SUFFIXES)),
        ("--theta DEG", "angles of the light from the normal, e.g. 0:80:10; default: by format",
         numbers),
        ("--phi DEG", "azimuths of the light from x towards y; of zemax, the mirror direction's; "
         "default: by format", numbers),
        ("--wavelength NM", "wavelengths in vacuum, e.g. 400:700:20; zemax has one, by default "
         "550; default: by format", numbers, None, {"dest": "wavelengths"}),
        ("--resolution N", "nodes of outgoing directions along an axis; default: 64 for rgl, 86 "
         "for zemax, 18 for bird and csv", whole_number(8)),
    )),
    surface_options(),
    options.heights(),
    options.json("what was written"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Write the file, and return the figures."""
    take_source(args)
    suffix = {"bird": ".json", "csv": ".csv"}.get(args.format, ".bsdf")
    output = output_of(args, Path(f"{args.source.stem}{suffix}"))
    suffix = output.suffix.lower()
    name = args.format or next(name for name, known in _SUFFIXES.items() if suffix in known)
    if suffix not in _SUFFIXES[name]:
        raise DiffractionError(f"-o {output}: {name} files end in {' or '.join(_SUFFIXES[name])}")

    set_variant(args.mode)
    from ..analysis.export import rgl, scatter, zemax

    module: Any = {"rgl": rgl, "zemax": zemax}.get(name, scatter)
    chosen = options.given(args, ("theta", "phi", "wavelengths"))
    arrays = {name: np.asarray(values, np.float64) for name, values in chosen.items()}
    grid = module.DEFAULT._replace(**arrays, **options.given(args, ["resolution"]))
    with Bar(args) as bar:
        bsdf = surface_bsdf(args)
        if "wavelengths" not in arrays:  # the format has its own, of which the table has some
            low, high = bsdf.describe().lit
            lit = (grid.wavelengths >= low) & (grid.wavelengths <= high)
            if 0 < lit.sum() < lit.size:
                grid = grid._replace(wavelengths=grid.wavelengths[lit])
        text = f"{args.source.name}: {bsdf.describe().text}"
        getattr(module, f"save_{name}")(bsdf, output, grid, text, bar)
    size = output.stat().st_size
    print(
        f"{args.source} -> {output}: {name}, {size / 1e6:.1f} MB, {grid.theta.size} x "
        f"{grid.phi.size} directions of light, {counted(grid.wavelengths.size, 'wavelength')}, "
        f"{elapsed(args):.1f} s"
    )
    return {"source": args.source, "file": output, "format": name, "bytes": size,
            "theta": grid.theta.tolist(), "phi": grid.phi.tolist(),
            "wavelengths": grid.wavelengths.tolist()}  # fmt: skip
