"""Light, material and camera of a mesh in a few words: options of `render`.

Each is short for parameters of the stage, `scenes/own_mesh.xml`, which -D may set instead.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import DiffractionError, quoted
from ..files import MESHES
from ..heights.lengths import numbers_of
from ..optics.materials import METALS, TISSUES
from ..plugin.conductors import is_tabulated
from ..scene.orbit import ORBIT
from ..scene.parameters import CLAMP, parameters_of
from ..scene.pictures import check_panorama
from ..scene.stage import STUDIO
from .values import number_between, value

#: Materials of --finish: parameters of the BSDF, that which --base sets, and its default.
LOOKS: dict[str, tuple[dict[str, str], str, str]] = {
    "metal": ({}, "material", "Al"),
    "coated": ({"coat_ior": "1.5"}, "material", "Al"),
    "skin": ({"material": "keratin"}, "pigment", "0.2"),
}
# Frames of --orbit, and irradiance of the sun beside a panorama, in the panorama's units of white.
_FRAMES, _IRRADIANCE = 24, 3.0


def _angles(text: str) -> tuple[str, str] | None:
    angles = numbers_of(text) or ()
    fits = len(angles) == 2 and 0.0 <= angles[1] <= 90.0
    return (f"{angles[0]:g}", f"{angles[1]:g}") if fits else None


#: Options of `render`; see `take_studio`.
STUDIO_OPTIONS = (
    ("--env FILE", "panorama (HDR, EXR) that lights the scene instead of lamps"),
    ("--sun AZ,EL", "azimuth (0 right, 90 away from the camera) and elevation of a sun, degrees; "
     "with a clear sky, or beside --env",
     value("azimuth and elevation in degrees, such as 120,40", _angles)),
    ("--finish", "material of --patch: metal, metal under clear lacquer, keratin over pigment; "
     "default: metal, or skin with a coloured --base", tuple(LOOKS)),
    ("--base COLOUR|FILE|METAL", "pigment of a skin: 'r,g,b', '#804020', sienna, a picture, the "
     "mesh's .glb; or the metal, e.g. gold"),
    ("--height-scale S", "factor on the heights", number_between(1e-6, 1000)),
    ("--orbit", "let the camera go around the mesh, or the surfaces of a scene that diffract, in "
     f"--frames ({_FRAMES}) pictures", bool),
    ("--clamp L", "limit of a sample, times white, against bright dots; 200 keeps most of a sun's "
     "streaks", number_between(1e-3, 1e6)),
)  # fmt: skip


def take_studio(args: argparse.Namespace) -> None:
    """Turn the options into values of -D and --turn; `args.scene` is a scene or a mesh.

    Raises a DiffractionError if a file cannot be read.
    """
    values: dict[str, str] = {}
    is_mesh = args.scene.suffix.lower() in MESHES
    if args.env is not None or args.sun is not None:
        sky = str(STUDIO.parent / ("daylight.xml" if args.env is None else "environment.xml"))
        # a light with its own floor
        floored = is_mesh or (parameters_of(args.scene) or {}).get("light") == "ring.xml"
        outdoors = str(STUDIO.with_name("outdoors.xml"))
        values |= {"light": outdoors, "sky": sky} if floored else {"light": sky}
    if args.env is not None:
        values["environment"] = str(check_panorama(Path(args.env)).absolute())
    if args.sun is not None:
        values |= {"sun_azimuth": args.sun[0], "sun_elevation": args.sun[1]}
        if args.env is not None:
            values["sun_irradiance"] = f"{_IRRADIANCE:g}"
    values |= _material(args)
    if args.height_scale is not None:
        values["height_scale"] = f"{args.height_scale:g}"
    if args.orbit:
        own = is_mesh or "camera_azimuth" in (parameters_of(args.scene) or {})
        args.turn = [*args.turn, "camera_azimuth" if own else ORBIT]
        args.frames = args.frames or _FRAMES
    if is_mesh and {"turn", "camera_azimuth"} & set(args.turn):
        values["frame"] = "turning"
    if args.clamp is not None:
        values[CLAMP] = f"{args.clamp:g}"
    # -D goes before: its value may be finer
    given = {name for name, _ in args.parameters}
    args.parameters = [*args.parameters, *((k, v) for k, v in values.items() if k not in given)]


def _material(args: argparse.Namespace) -> dict[str, str]:
    """Return the parameters of --finish and --base."""
    if args.finish is None and args.base is None:
        return {}
    if args.patch is None:
        args.parser.error("--finish and --base are for a mesh with --patch; a preset has its "
                          "material: --preset cd,pigment=sienna")  # fmt: skip
    look = args.finish or ("metal" if _is_metal(args.base) else "skin")
    values, name, default = LOOKS[look]
    if name == "material" and args.base is not None and not _is_metal(args.base):
        raise DiffractionError(
            f"--base {quoted(args.base)} is not a metal, which --finish {look} needs, e.g. gold or "
            "Cr; a colour or a picture is for --finish skin"
        )
    return {**values, name: args.base or default}


def _is_metal(text: str) -> bool:
    """Whether a text names a conductor, by symbol or plain name."""
    name = METALS.get(text.lower(), text)
    return name not in TISSUES and is_tabulated(name)
