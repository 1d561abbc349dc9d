"""Files of a survey, grouped into repeated scans of one sample."""

from __future__ import annotations

import glob
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..columns import save_rows
from ..errors import DiffractionError, warn
from ..files import FileKind, kind_of
from ..inputs import note_folder
from ..scene.parameters import note_files
from .iridescence import HUES

#: How repeated scans are told: by names that differ in their last number, or by folders.
REPEATS = ("name", "folder")
#: Columns of rows that are averaged over repeated scans.
AVERAGED = (
    "range_um", "rms_height_um", "rms_slope", "period_1_um", "share_1", "diffracted", "brightest",
    "iridescence", "iridescent_light", *(f"share_{name}" for name in (*HUES, "grey")),
)  # fmt: skip

# Files that lie beside scans and hold no heights.
_NO_SCANS = (
    ".cfg", ".doc", ".docx", ".gz", ".html", ".ini", ".json", ".log", ".md", ".ods", ".pdf", ".py",
    ".r", ".xls", ".xlsx", ".xml", ".yaml", ".zip",
)  # fmt: skip
# Number at the end of a name, with what separates it.
_NUMBER = re.compile(r"[\s_.()#-]*\d+\)?$")


def scan_files(names: Iterable[Path]) -> list[Path]:
    """List scans: files as they are named, files of folders, and files that match patterns.

    Folders are not searched deeper; hidden files, and files of documents, are left out of them.
    Plots and tables that this program wrote beside the scans are left out with a warning.

    Raises a DiffractionError if a folder holds no file, no file matches a pattern, no file exists,
    or all are such results. One that is missing among others is listed: its reader says so.
    """
    files: dict[Path, None] = {}
    for name in names:
        if name.is_dir():
            held = _held(name)
            if not held:
                deeper = any(_held(f) for f in name.iterdir() if f.is_dir())
                raise DiffractionError(
                    f"'{name}' holds no scans"
                    + (f" itself; name those in its folders, '{name / '*' / '*'}'" if deeper
                       else "; name another folder")
                )  # fmt: skip
            if not all(kind_of(file) is FileKind.RESULT for file in held):
                note_folder(name)  # else that of an earlier survey, which this one may go on
        elif not name.exists() and glob.has_magic(str(name)):
            held = [Path(f) for f in sorted(glob.glob(str(name), recursive=True))]
            held = [f for f in held if f.is_file()]
            if not held:
                raise DiffractionError(f"no file matches '{name}'; check the pattern")
        else:
            held = [name]
        files |= dict.fromkeys(held)
    if files and not any(file.exists() for file in files):
        raise DiffractionError(f"'{next(iter(files))}' does not exist; check the path")
    results = [file for file in files if kind_of(file) is FileKind.RESULT]
    if results and len(results) == len(files):
        raise DiffractionError(f"'{results[0]}' is a {FileKind.RESULT}, and no scan; name scans")
    if results:
        warn(f"left out, each a {FileKind.RESULT}: {', '.join(map(str, results))}")
    scans = [file for file in files if file not in results]
    for file in scans:
        note_files(file)
    return scans


def _held(folder: Path) -> list[Path]:
    """List the files of a folder that may be scans."""
    shown = [f for f in sorted(folder.iterdir()) if f.is_file() and f.name[0] != "."]
    return [f for f in shown if f.suffix.lower() not in _NO_SCANS]


def sample_of(file: Path, repeats: str = "name") -> str:
    """Return the sample of a scan: its folder, or its path without the number at the end.

    The suffix is left out: `scale_1.spm`, `scale-02.spm` and `scale.003` are scans of `scale`.
    """
    if repeats == "folder":
        return str(file.parent)
    name = _NUMBER.sub("", file.stem)
    return str(file.parent / name) if name else str(file.parent)


def write_repeats(path: Path, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Write a row for each sample as CSV, with means and standard errors, and return the rows.

    The standard error of the mean is s/√n, with s the standard deviation of n measured scans; it is
    empty for a single scan. A quantity that some scans lack has the mean of the others.
    """
    samples: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        samples.setdefault(row["sample"], []).append(row)
    averaged = [_averaged(sample, scans) for sample, scans in samples.items()]
    columns = [f"{name}{end}" for name in AVERAGED for end in ("", "_se")]
    names = ["sample", "scans", "failed", *columns]
    save_rows(path, names, averaged)
    return averaged


def _averaged(sample: str, scans: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Average the measured rows of a sample."""
    measured = [row for row in scans if not row["reason"]]
    result: dict[str, Any] = {"sample": sample, "scans": len(measured)}
    result["failed"] = len(scans) - len(measured)
    for name in AVERAGED:
        values = [row[name] for row in measured if row.get(name, "") != ""]
        if values:
            result[name] = float(np.mean(values))
        if len(values) > 1:
            result[f"{name}_se"] = float(np.std(values, ddof=1) / math.sqrt(len(values)))
    return result
