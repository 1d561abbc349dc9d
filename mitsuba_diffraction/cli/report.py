"""Outputs checked before hours of work; plain data as text for people and as JSON."""

from __future__ import annotations

import argparse
import itertools
import json
import math
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, is_dataclass
from numbers import Real
from pathlib import Path
from typing import Any

from ..atomic import atomic_path, check_target
from ..errors import DiffractionError
from ..inputs import input_at, refuse_in_folder
from .console import say

#: What a command measured and wrote, for --json.
Figures = dict[str, Any]
#: `--json` without a file, which only `info` has: printed instead of the text.
STDOUT = Path("-")

# Keys of height-field summaries, which are in µm throughout, and suffixes of keys that say so.
_UNITS = {"pixel_size": "µm", "extent": "µm", "range": "µm", "rms_height": "µm"}
_SUFFIXES = {"_um": "µm", "_nm": "nm", "_mb": "MB", "_s": "s", "_deg": "°"}
_SHAPE = "shape"
#: Suffixes of files that commands write: a folder that is to be made has none of them.
_OF_FILES = frozenset({".csv", ".exr", ".glsl", ".html", ".json", ".md", ".npz", ".png", ".toml"})
_INDENT = "  "


def lines_of(data: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each value: keys in words, aligned; nested mappings are indented."""
    # of arrays (ny, nx), which people are told as pixels along x and y, as extents
    turned = ((k, v[::-1] if k == _SHAPE and isinstance(v, list) else v) for k, v in data.items())
    rows = [(*_label(key), value) for key, value in turned]
    width = max((len(label) for label, _, value in rows if not _nested(value)), default=0)
    for label, unit, value in rows:
        if not _nested(value):
            joint = " to " if label.endswith("range") else " x "
            yield f"{label + ':':<{width + 1}} {_text(value, joint)} {unit}".rstrip()
            continue
        yield f"{label}:"
        if isinstance(value, Mapping):
            yield from (f"{_INDENT}{line}" for line in lines_of(value))
            continue
        for item in value:
            lines = lines_of(item) if isinstance(item, Mapping) else [_text(item)]
            for n, line in enumerate(lines):
                yield f"{_INDENT}{'  ' if n else '- '}{line}"


def plain(value: Any) -> Any:
    """Convert data for JSON, which has neither NaN nor infinity: they become null."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # an array or scalar of NumPy
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)


def save_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write data as JSON.

    Raises a DiffractionError if the file cannot be written.
    """
    with atomic_path(path) as temporary:
        text = json.dumps(plain(data), indent=1, ensure_ascii=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def elapsed(args: argparse.Namespace) -> float:
    """Return the seconds since the command began."""
    return time.perf_counter() - args.began


def _label(key: str) -> tuple[str, str]:
    unit = _UNITS.get(key, "")
    key = "pixels" if key == _SHAPE else key
    for suffix, its_unit in _SUFFIXES.items():
        if not unit and key.endswith(suffix):
            key, unit = key.removesuffix(suffix), its_unit
    return " ".join(key.replace("_", " ").split()), unit


def _nested(value: Any) -> bool:
    """Whether a value needs lines of its own: mappings, and lists of texts or mappings."""
    if isinstance(value, (list, tuple)):
        return any(isinstance(item, (str, Mapping, list, tuple)) for item in value)
    return isinstance(value, Mapping) and bool(value)


def _text(value: Any, joint: str = " x ") -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple, Mapping)):
        return joint.join(_text(item) for item in value) if value else "none"
    if isinstance(value, Real) and not isinstance(value, int):
        return f"{float(value):.4g}"
    return " ".join(str(value).split())


def check_outputs(outputs: Iterable[Path], *, make_folder: bool = False) -> None:
    """Refuse outputs that cannot be written, or that would replace a file that the command reads.

    make_folder : a missing folder will be made, so the nearest existing one has to be writable.

    Raises a DiffractionError as `atomic.check_target` does, or if the folder is missing, cannot be
    written, is a file, or is one of which the command reads every file. No file is left behind.
    """
    folders: dict[Path, Path] = {}
    for path in outputs:
        check_target(path)
        refuse_in_folder(path)
        folders.setdefault(path.parent, path)
    for path in folders.values():
        _check_folder(path, make_folder)


def _check_folder(path: Path, make_folder: bool) -> None:
    """Refuse an output in whose folder no file can be made."""
    folder = path.parent
    if make_folder and folder.exists() and not folder.is_dir():
        raise DiffractionError(f"cannot write to '{folder}': it is a file; name a folder")
    if make_folder and not folder.exists() and folder.suffix.lower() in _OF_FILES:
        raise DiffractionError(
            f"cannot write to '{folder}': the command writes several files; name a folder"
        )
    while make_folder and not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        # the permission bits do not tell: file systems may be read-only, or full of inodes
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise DiffractionError(
            f"cannot write '{path}': {error.strerror}; choose a folder that exists and is writable"
        ) from error


def _free_name(default: Path, files: Callable[[Path], Iterable[Path]]) -> Path:
    """Return the default name, with a number if it would replace a file that the command reads."""
    names = (default.with_name(f"{default.stem}-{n}{default.suffix}") for n in itertools.count(2))
    read: list[str] = []
    for name in itertools.chain([default], names):
        found = [source for file in files(name) if (source := input_at(file)) is not None]
        if not found:
            break
        read += found
    if read:
        say(f"this command reads '{read[0]}', so its output is called '{name}'")
    return name


def output_of(
    args: argparse.Namespace, default: Path,
    files: Callable[[Path], Iterable[Path]] = lambda path: [path], *, make_folder: bool = False,
) -> Path:  # fmt: skip
    """Return the output of -o, or its default name, after `check_outputs` of all its files.

    A default name that would replace a file that the command reads gets a number, in one line on
    stderr.

    files : returns all files that an output of this name has.
    """
    output: Path = args.output or _free_name(default, files)
    check_outputs(files(output), make_folder=make_folder)
    return output


def exr_and_png(output: Path) -> list[Path]:
    """Return the files of a picture of this name: an EXR and the PNG beside it, or only a PNG."""
    return [output] if output.suffix.lower() == ".png" else [output, output.with_suffix(".png")]


def beside(*suffixes: str) -> Callable[[Path], list[Path]]:
    """Return the function that lists the files of an output: itself, and some of its name."""
    return lambda output: [output, *(output.with_suffix(suffix) for suffix in suffixes)]
