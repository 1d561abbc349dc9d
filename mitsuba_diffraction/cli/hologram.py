"""`mitsuba-diffraction hologram`: from a logo to a scene with its hologram."""

from __future__ import annotations

import argparse
from pathlib import Path
from shlex import quote

from ..scene import set_variant
from . import options
from .report import Figures, output_of
from .values import number_between, whole_number


@options.command(
    "hologram", "make a hologram of a logo: textures and a scene",
    "Divide a picture into areas of a few colours, give each the grating that shows its "
    "colour, and write textures and a scene with a card, or with a label on the front of a "
    "mesh: docs/holograms.md. Transparent pixels, black and the ground stay blank foil.",
    ("PICTURE", "PNG, JPEG, ...", Path),
    ("--mesh FILE", "mesh with texture coordinates", Path),
    ("-o --output FOLDER", "default: PICTURE_hologram", Path),
    ("--colours N", "largest number of colours", whole_number(1), 6),
    ("--dots N", "dots along the longer side", whole_number(16), 512),
    ("--keep-ground", "give the colour of most of the border a grating, too", bool),
    ("--width S", "of a label, as a share of the mesh's width", number_between(0.01, 10), 0.5),
    ("--height S", "of a label's middle, as a share of the mesh's height",
     number_between(0, 1), 0.5),
    ("--turn DEG", "turn the mesh around the vertical, which puts another side to the front",
     number_between(-360, 360), 0.0),
    ("--up AXIS", "axis of the mesh that points upwards: x, y, z, with a minus sign if it "
     "points downwards", str, "auto"),
    options.json("colours and files"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Write the folder, print the colours, and return the figures."""
    if args.mesh is None:
        of_label = ("width", "height", "turn", "up")
        options.refuse(args, of_label, ": is for a label on a mesh; add --mesh FILE")
    from ..scene import label
    from ..scene.logo import areas

    default = Path(f"{args.picture.stem}_hologram")
    folder = output_of(args, default, label.files_in, make_folder=True)
    parts = areas(args.picture, colours=args.colours, dots=args.dots, keep_ground=args.keep_ground)
    ny, nx = parts.labels.shape
    values = {}
    if args.mesh is None:
        place = label.card(nx / ny)
    else:
        set_variant("scalar_rgb")
        place = label.front(
            args.mesh, nx / ny, width=args.width, height=args.height, up=args.up, turn=args.turn
        )
        values = {"turn": f"{args.turn:g}", "up": args.up}
    scene = label.write(folder, parts, place, args.mesh, **values)
    for line in label.described(parts):
        print(line)
    print(f"{scene}: render it, e.g. mitsuba-diffraction render {quote(str(scene))} --denoise")
    return {"scene": scene, "colours": label.described(parts)}
