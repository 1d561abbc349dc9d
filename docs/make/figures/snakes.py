"""The snakes of the scenes, in two lights each.

python -m docs.make.figures.snakes -o docs/images
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from mitsuba_diffraction.cli import main as command
from mitsuba_diffraction.errors import DiffractionError

from .jpeg import write_jpeg
from .program import exit_code

#: Names of the pictures and what is rendered: scene, azimuth of the sun in degrees.
PICTURES = {
    "snake": ("snake.xml", 120),
    "snake_other_light": ("snake.xml", 60),
    "xenopeltis": ("xenopeltis.xml", 120),
    "xenopeltis_other_light": ("xenopeltis.xml", 60),
}

_SIZE = (900, 563)


def render_snakes(
    folder: Path, scenes: Path, *, spp: int, size: tuple[int, int] = _SIZE
) -> list[Path]:
    """Render all `PICTURES` to JPEG files in `folder`.

    Parameters
    ----------
    scenes : folder of the scenes.
    spp : samples per pixel.
    size : pixels, width and height.

    Raises
    ------
    DiffractionError
        If the scenes are missing, a rendering fails, or a picture cannot be written.
    """
    written = []
    for name, (scene, azimuth) in PICTURES.items():
        file = scenes / scene
        if not file.is_file():
            raise DiffractionError(
                f"'{file}' does not exist; run this where the project's scenes are, or name their "
                "folder with --scenes"
            )
        output = folder / f"{name}.jpg"
        with tempfile.TemporaryDirectory() as temporary:
            png = Path(temporary, "picture.png")
            values = {
                "light": "daylight.xml",
                "sun_azimuth": azimuth,
                "resx": size[0],
                "resy": size[1],
            }
            defined = [part for key, value in values.items() for part in ("-D", f"{key}={value}")]
            with contextlib.redirect_stdout(io.StringIO()):  # it would name the temporary file
                code = command(["render", str(file), "-o", str(png), "-s", str(spp), *defined])
            if code != 0:
                raise DiffractionError(f"rendering '{file}' failed; see above")
            write_jpeg(png, output)
        written.append(output)
    return written


def main(argv: Sequence[str] | None = None) -> int:
    """Render the pictures."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.snakes")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images"))
    parser.add_argument("--scenes", type=Path, default=Path("scenes"))
    parser.add_argument("-s", "--spp", type=int, default=64, help="samples per pixel")
    args = parser.parse_args(argv)

    def work() -> None:
        render_snakes(args.output, args.scenes, spp=args.spp)

    return exit_code("snakes", work)


if __name__ == "__main__":
    sys.exit(main())
