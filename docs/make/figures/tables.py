"""Tables of pages from measurements by commands: performance, accuracy, energy, realtime, thesis.

python -m docs.make.bench --json out/bench.json
python -m docs.make.figures.tables speed out/bench.json

Likewise `tradeoff` of the folder that `tradeoff -o` writes, `plan` of `plan --json`, `sweep` of
`sweep --json`, `energy` of what `info --energy --json` found of each surface, and `realtime` of the
folders that `compare -o` wrote for scenes.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.realtime.shader_comparison import plain_number
from mitsuba_diffraction.thesis.sweeps import label_of

from . import long_tables, pages
from .pages import from_json, option, program, write_jpeg

#: Names of files, and what commands wrote into these.
Documents: TypeAlias = Sequence[tuple[str, dict[str, Any]]]
# pixels of a picture as JPEG
_WIDTH = 1600


@dataclass(frozen=True)
class Figure:
    """Row of the table of speed."""

    # section, row: how the section's title and the row's name begin
    section: str
    row: str
    words: str  # what is said of it
    column: str  # of the row
    pattern: str  # how the number is written
    goal: int | None = None  # which of the row's goals is for this number


_ROUGH, _DEFAULT = "× roughconductor", "diffraction, the defaults"
_SOLVED = "solved orders"
_EFFICIENCY, _DELTA = "variance × time, ratio", "mean ΔE2000"
FIGURES = (
    Figure("build", "1332²", "table of 1332² pixels", "s", "{:.1f} s", 0),
    Figure("build", "1332²", "its memory, Python's included", "GB at most", "{:.2f} GB", 1),
    Figure("build", "4096²", "table of 4096² pixels", "s", "{:.0f} s", 0),
    Figure("build", "4096²", "its memory", "GB at most", "{:.2f} GB", 1),
    Figure("build", "8192²", "table of 8192² pixels", "s", "{:.0f} s", 0),
    Figure("build", "8192²", "its memory", "GB at most", "{:.2f} GB", 1),
    Figure("eval", _DEFAULT, "`eval` / `roughconductor` (Al)", _ROUGH, "{:.1f}", 0),
    Figure("eval", "diffraction, tolerance 1e-2", "`eval`, tolerance 1e-2 / 1e-3", "× defaults",
           "{:.2f}", 0),
    Figure("eval", "principled, metal", "`principled` / `roughconductor`", _ROUGH, "{:.1f}"),
    Figure("eval", "measured", "`measured` / `roughconductor`", _ROUGH, "{:.0f}"),
    Figure("eval", _DEFAULT, "`eval` / bare gathers, which only read", "× gathers", "{:.2f}", 1),
    Figure("eval", "thesis", "the thesis' look-up / `eval`", "× defaults", "{:.0f}", 0),
    Figure("sample", _DEFAULT, "`sample` / `roughconductor` (Al)", _ROUGH, "{:.1f}"),
    Figure("snake", "the skin", "the snake's scene / with `roughconductor`", _ROUGH, "{:.1f}", 0),
    Figure("noise", "0°", "noise of one sample, light from 0°", "most", "{:.2f}", 0),
    Figure("noise", "45°", "from 45°", "most", "{:.2f}", 0),
    Figure("noise", "75°", "from 75°", "most", "{:.2f}", 0),
    Figure(_SOLVED, "eval CD", "a CD's solved orders, `eval` / `roughconductor`", _ROUGH, "{:.1f}",
           0),
    Figure(_SOLVED, "sample CD", "their `sample` / `roughconductor`", _ROUGH, "{:.1f}", 0),
    Figure(f"noise of {_SOLVED}", "CD, 0°", "their noise, light from 0°", "most", "{:.2f}", 0),
    Figure(f"noise of {_SOLVED}", "CD, 45°", "from 45°", "most", "{:.2f}", 0),
    Figure(f"noise of {_SOLVED}", "CD, 75°", "from 75°", "most", "{:.2f}", 0),
    Figure("efficiency", "white", "variance × time in a white furnace, cosine sampling's / ours",
           _EFFICIENCY, "{:.0f}", 0),
    Figure("efficiency", "snake", "the same, snake under a window", _EFFICIENCY, "{:.0f}", 0),
    Figure("efficiency", "snake", "its brightest pixel, 64 samples / converged",
           "brightest pixel, ratio", "{:.1f}", 1),
    Figure("colours", "map, diel", "RGB variants, ΔE2000 of a dielectric", _DELTA, "{:.2f}", 0),
    Figure("colours", "map, alu", "of aluminium's", _DELTA, "{:.2f}"),
    Figure("colours", "map, gold", "of gold's", _DELTA, "{:.1f}"),
    Figure("colours", "snake in the sun, pig", "of the snake in the sun", _DELTA, "{:.2f}", 0),
    Figure("colour table", "", "`eval`, RGB / spectral", "× spectral", "{:.2f}", 2),
)  # fmt: skip


def _of_one(
    tables: Callable[[dict[str, Any]], dict[str, str]],
) -> Callable[[Documents], dict[str, str]]:
    """Return the tables of a single document."""
    return lambda documents: tables(documents[0][1])


def speed(measured: dict[str, Any]) -> dict[str, str]:
    """Tables of speed and memory with the machine and the goals."""
    machine = measured["machine"]
    head = f"Measured by `make bench` on {machine['cores']} cores ({machine['processor']})"
    versions = f"Mitsuba {machine['mitsuba']}, version {machine['mitsuba_diffraction']}"
    table = pages.table(("", "figure", "goal"), tuple(_goals(measured["sections"])))
    return {"speed": f"{head}, {versions}.\n\n{table}"}


def _goals(
    sections: list[dict[str, Any]], figures: Sequence[Figure] = FIGURES
) -> Iterator[tuple[str, str, str]]:
    for figure in figures:
        row = _measured(sections, figure.section, figure.row)
        goal = ""
        if figure.goal is not None and row["goals"]:
            said = row["goals"][figure.goal]
            goal = said["goal"] if said["met"] else f"**missed:** {said['goal']}"
        yield figure.words, figure.pattern.format(row["values"][figure.column]), goal


def _measured(sections: list[dict[str, Any]], title: str, name: str) -> dict[str, Any]:
    for section in sections:
        if section["title"].startswith(f"{title}:"):
            for row in section["rows"]:
                if row["name"].startswith(name):
                    return dict(row)
    raise DiffractionError(
        f"nothing was measured of '{title}: {name}'; run bench in full: without --only or --quick"
    )


_ALUMINIUM = Figure("eval", "diffraction, Al", "of aluminium", _ROUGH, "{:.1f}")
_FRAMES = tuple(
    Figure("frames", method, f"frames a second of the snake, `{method}`", "frames/s", "{:.3g}", 0)
    for method in ("fast", "exact")
)
_RATIOS = ("eval", "sample", "snake", _SOLVED)


def graphics_card(measured: dict[str, Any]) -> dict[str, str]:
    """Ratios by processor and graphics card, and frames of the shaders."""
    machine, sections = measured["machine"], measured["sections"]
    drivers = [s["title"].split(",")[0] for s in sections if s["title"].startswith("frames:")]
    kinds = {"llvm": f"{machine['processor']}, {machine['cores']} cores", "cuda": "by CUDA"}
    found = {
        kind: [s for s in sections if f": {kind}_ad" in s["title"]]
        for kind in kinds
        if any(f": {kind}_ad" in s["title"] for s in sections)
    }
    figures = [f for f in FIGURES if f.section in _RATIOS and f.column == _ROUGH] + [_ALUMINIUM]
    rows = [
        (f.words, *(_number(f, of_kind) for of_kind in found.values()), "")
        for f in sorted(figures, key=lambda f: _RATIOS.index(f.section))
    ]
    empty = [""] * len(found)
    rows += [(words, *empty, f"{n}; {g}" if g else n) for words, n, g in _goals(sections, _FRAMES)]
    heads = ("", *(kinds[kind] for kind in found), *(d.removeprefix("frames: ") for d in drivers))
    return {"card": pages.table(heads, tuple(rows))}


def _number(figure: Figure, sections: list[dict[str, Any]]) -> str:
    row = _measured(sections, figure.section, figure.row)
    return figure.pattern.format(row["values"][figure.column])


_SETTINGS = (
    "setting", "error", "ΔE2000, mean (99 %)", "`eval` / `roughconductor`", "taps × numbers", "MB",
    "built in, s",
)  # fmt: skip


def tradeoff(measured: dict[str, Any]) -> dict[str, str]:
    """Errors, times and sizes by setting; sums over the spectrum."""
    settings = measured["settings"]
    machine = measured["machine"]
    where = f"{measured['patch']}; {machine['cores']} cores ({machine['processor']})"
    return {
        "settings": f"{pages.table(_SETTINGS, tuple(_settings(settings)))}\n\n{where}.",
        "spectral": _spectral(measured["spectral"]),
    }


def _settings(records: Sequence[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    for record in records:
        if record["refused"]:
            yield record["setting"], f"refused: {record['refused']}", "", "", "", "", ""
            continue
        yield (
            record["setting"],
            f"{record['error']:.1e}",
            f"{record['delta_e']:.3f} ({record['delta_e_99']:.2f})",
            f"{record['relative']:.2f}",
            f"{record['taps']} × {record['terms']} ({record['precision']})",
            f"{record['megabytes']:.1f}",
            f"{record['seconds']:.1f}",
        )


def _spectral(spectral: dict[str, Any]) -> str:
    steps, counts = spectral["steps"], spectral["counts"]
    by_step = pages.table(
        ("step of a sum", *(f"{float(step):g} nm" for step in steps)),
        [("ΔE2000, mean", *(f"{error:.2f}" for error in steps.values()))],
    )
    by_count = pages.table(
        ("wavelengths of a ray", *counts),
        [("noise of its luminance", *(f"{noise:.2f}" for noise in counts.values()))],
    )
    return f"{by_step}\n\n{by_count}"


def plan(report: dict[str, Any]) -> dict[str, str]:
    """Needs and memory of a plan beside the whole table."""
    table = report["tables"][0]
    whole, planned = table["whole"], table["planned"]
    asked, needs = table["asked for"], table["needs"]
    frequency = asked["frequency (rad/µm)"]["light can probe"]
    kappa = asked["kappa (rad/µm)"]["the table has"]
    rows = [
        ("frequencies, rad/µm", f"up to {frequency:.1f}", _frequencies(needs)),
        ("κ, rad/µm", f"up to {kappa:.1f}", f"up to {needs['kappa (rad/µm)']:.1f}"),
        ("series in κ, terms", str(whole["terms"]), str(planned["terms"])),
        ("table", *(f"{figures['memory_mb']:.2g} MB" for figures in (whole, planned))),
    ]
    missing = needs["share of the light outside, at most"]
    change = f"and at most {100 * missing:.2g} % of the light from the skin is missing"
    less = table["times less memory"]
    return {
        "plan": f"{pages.table(('', 'whole table', 'planned'), rows)}\n\n"
        f"{less:.1f} times less memory, {change}.",
    }


def _frequencies(needs: dict[str, Any]) -> str:
    for name, value in needs.items():
        if name.startswith("frequency"):
            return f"up to {' and '.join(f'{v:.1f}' for v in value)} along x and y"
    raise KeyError("frequency")


_ENERGY = (
    "table", "material", "albedo", "conserved", "taken at 0, 45, 60, 75°", "kept", "within 1 %",
    "where above 1", "0.97–1.001",
)  # fmt: skip


def energy(documents: Documents) -> dict[str, str]:
    """A row for each table and material."""
    rows = [
        _row(name, material, figures)
        for name, report in documents
        for material, figures in report["energy"].items()
    ]
    return {"energy": pages.table(_ENERGY, rows)}


def _row(name: str, material: str, figures: dict[str, Any]) -> tuple[str, ...]:
    above = figures.get("conserved where raw is above 1")
    within = figures.get("between 0.97 and 1.001 there")
    taken = ", ".join(f"{100 * max(0.0, share):.1f}" for share in figures["taken at"].values())
    return (
        name,
        material,
        _range(figures["albedo"]),
        _range(figures["albedo, conserved"]),
        f"{taken} %",
        _range(figures["conserved over raw where that is at most 1"]),
        f"{100 * figures['within 1 % there']:.0f} %",
        "–" if above is None else _range(above),
        "–" if within is None else f"{100 * within:.0f} %",
    )


def _range(ends: Sequence[float]) -> str:
    return f"{ends[0]:.3f}–{ends[1]:.3f}"


def swept(report: dict[str, Any]) -> dict[str, str]:
    """ΔE of every value of a sweep from the reference, which is the map without any."""
    kind, rows = report["sweep"], []
    for step in report["steps"]:
        apart = step["delta_e_mean"]
        shown = "" if apart is None else f"{apart:.2g}" if apart else "reference"
        rows.append((label_of(kind, step["value"]), shown))
    return {kind: pages.table(("value", "mean ΔE"), rows)}


_OURS = ("fast", "exact")


def realtime(documents: Documents) -> dict[str, str]:
    """Deviations of the shaders over all pixels of scenes, and the noise in them.

    Times and textures are of the first scene.
    """
    header = ("scene", *(f"`{m}`" for m in _OURS), "noise of `exact`", "of the path tracer")
    rows, high = [], 0.0
    for _, document in documents:
        entries = [document["methods"][method] for method in _OURS]
        values = [
            *(entry["direct"]["delta_e_mean"] for entry in entries),
            entries[-1]["noise"]["delta_e_mean"],
            document["noise"]["delta_e_mean"],
        ]
        high = max(high, *(e["direct"]["delta_e_percentiles"]["99"] for e in entries))
        link = f"[{Path(document['scene']).stem}]({document['scene']})"
        # links of `compare` start at the repository's root, links of the page in docs
        rows.append((link.replace("](scenes/", "](../scenes/"), *map(plain_number, values)))
    fast, exact = (documents[0][1]["methods"][method] for method in _OURS)
    sizes = [plain_number(entry["texture_bytes"] / 1e6) for entry in (fast, exact)]
    return {
        "realtime": pages.table(header, rows),
        "most": plain_number(high),
        "times": plain_number(exact["frame_ms"] / fast["frame_ms"]),
        "textures": f"{sizes[0]} MB (`fast`) and {sizes[1]} MB (`exact`)",
    }


@dataclass(frozen=True)
class Part:
    """Reader and writer of the measurements of a command."""

    tables: Callable[[Documents], dict[str, str]]  # Markdown by the name of its markers
    page: str  # that has the markers
    writer: str  # the command that writes such documents
    remedy: str  # what to do about another file
    # a document in a folder, and pictures there, by the names that they have in docs/images
    document: str = ""
    pictures: Mapping[str, str] = field(default_factory=dict)


PARTS = {
    "speed": Part(_of_one(speed), "docs/performance.md", "docs.make.bench --json",
                  "run make bench"),
    "card": Part(_of_one(graphics_card), "docs/performance.md", "docs.make.bench --json",
                 "run make bench-gpu"),
    "tradeoff": Part(_of_one(tradeoff), "docs/accuracy.md", "tradeoff", "run make tradeoff",
                     "tradeoff.json", {name: name for name in ("tradeoff.png", "depth.png")}),
    "plan": Part(_of_one(plan), "docs/performance.md", "plan --json", "run make plan"),
    "sweep": Part(_of_one(swept), "docs/thesis.md", "sweep --json", "run make sweeps"),
    "energy": Part(energy, "docs/energy.md", "info --energy --json", "run make energy"),
    "realtime": Part(realtime, "docs/realtime.md", "compare",
                     "run compare with the methods fast and exact, or all", "compare.json",
                     {"realtime.jpg": "fast.png"}),
}  # fmt: skip


# Parts whose tables are files beside the page.
_LONG = ("tradeoff", "energy")


@program(
    option("part", choices=tuple(PARTS)),
    option("measured", metavar="FILE", type=Path, nargs="+", help="JSON, or a folder"),
    option("-o", "--output", metavar="FILE", type=Path, help="page; default: the one in docs"),
    option("--images", metavar="FOLDER", type=Path, default=Path("docs/images")),
    option(
        "--pictures", metavar="FOLDER", type=Path,
        help="a folder with larger pictures; default: the first that is measured",
    ),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Write the tables of one part into its page."""
    part = PARTS[args.part]

    def checked(document: dict[str, Any]) -> dict[str, Any]:
        part.tables([("", document)])  # an incomplete document fails here
        return document

    files = [measured / part.document for measured in args.measured]
    documents = [
        (file.stem, from_json(file, checked, writer=part.writer, remedy=part.remedy))
        for file in files
    ]
    update = long_tables.update if args.part in _LONG else pages.update
    update(args.output or Path(part.page), part.tables(documents))
    for target, name in part.pictures.items():
        file = (args.pictures or args.measured[0]) / name
        if target.endswith(".jpg"):
            write_jpeg(file, args.images / target, width=_WIDTH)
            continue
        with atomic_path(args.images / target) as temporary:
            shutil.copyfile(file, temporary)
