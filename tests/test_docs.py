"""What README and docs say to type works: commands parse, targets, files and examples exist."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.files import MESHES
from mitsuba_diffraction.scene.parameters import parameters_of
from mitsuba_diffraction.scene.stage import STUDIO
from scenes.make.__main__ import build_parser as meshes_parser
from tests.support import ROOT
from tests.support.pages import FENCE, PAGES, blocks, files_of, spans, typed

PACKAGE = Path(md.__file__).parent
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
SCRIPT = [sys.executable, PACKAGE / "osl" / "blender_material.py", "--help"]
SCRIPT_HELP = subprocess.run(SCRIPT, capture_output=True, text=True, check=True).stdout
BLENDER_OPTIONS = {"--", "--python"} | set(re.findall(r"--[a-z-]+", SCRIPT_HELP))
EARLIER = {"--look", "--view"}  # which the changelog names
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

_COMMAND = re.compile(r"(\.venv/bin/)?(mitsuba-diffraction|python -m|make) ")


COMMANDS = [
    pytest.param(page, words, id=f"{page}: {' '.join(words)}"[:90])
    for page in PAGES
    for text in (
        *blocks(page, "sh"),
        *(span for span in spans(page) if _COMMAND.match(span)),
    )
    for words in typed(text)
]


@pytest.mark.parametrize(("page", "words"), COMMANDS)
def test_a_documented_command_is_one(page, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in files_of(page).items():  # the parser reads files of layers
        (tmp_path / name).write_text(text, encoding="utf-8")
    program, *rest = words
    match Path(program).name, rest:
        case "mitsuba-diffraction", _:
            check_command(rest)
        case "python", ["-m", "scenes.make", _, _, *_]:
            meshes_parser().parse_args(rest[2:])
        case "python", ["-m", module, *_]:
            assert importlib.util.find_spec(module) is not None
        case "make", _:
            assert {word for word in rest if "=" not in word} <= TARGETS
        case "blender" | "python", [*_] if "cd-osl/blender_material.py" in rest:
            assert {word for word in rest if word.startswith("--")} <= BLENDER_OPTIONS
        case "pip", ["install", what]:
            extras = re.search(r"\[(.*)\]", what)
            assert what.startswith(".")
            assert extras is None or set(extras[1].split(",")) <= set(
                PROJECT["optional-dependencies"]
            )
        case ("apt", ["install", *_]) | ("printf" | "source", _):
            pass
        case _:
            pytest.fail(f"nothing here knows how to check '{program}'")
    for word in rest:
        if word.startswith(("scenes/", "precompute/")):
            assert (ROOT / word).exists(), word


def check_command(words: list[str]) -> None:
    """The real parser takes it, and its scene has the parameters."""
    if len(words) == 1 and not words[0].startswith("-"):
        words = [*words, "--help"]  # a command that a sentence names
    try:
        args = build_parser().parse_args(words)
    except SystemExit as stop:
        assert stop.code == 0, words  # --help and --version
        return
    if hasattr(args, "scene") and hasattr(args, "parameters"):
        scene = STUDIO if args.scene.suffix in MESHES else ROOT / args.scene
        if scene.name == "label.xml":  # written by `hologram`
            scene = STUDIO.with_name(scene.name)
        known = parameters_of(scene)
        assert known is not None
        assert {name for name, _ in args.parameters} <= set(known)


def test_every_option_in_a_sentence_is_one_of_some_command():
    known = options_of(build_parser()) | options_of(meshes_parser()) | EARLIER
    # those of the programs that make documents
    own = {
        option
        for path in (ROOT / "docs" / "make").rglob("*.py")
        for option in re.findall(
            r'(?:argument|option)\([^)]*?"(--[\w-]+)"', path.read_text("utf-8")
        )
    }
    for page in PAGES:
        for span in spans(page):
            if span.startswith("-"):
                for option in re.findall(r"(?<!\S)--?[a-zA-Z][\w-]*", span):
                    assert option in known | own | BLENDER_OPTIONS, f"{page}: {span}"


def options_of(parser) -> set[str]:
    """All options of a parser and its sub-commands."""
    found: set[str] = set()
    for action in parser._actions:
        found.update(action.option_strings)
        if hasattr(action, "choices") and isinstance(action.choices, dict):
            for subparser in action.choices.values():
                found |= options_of(subparser)
    return found


@pytest.mark.parametrize("page", PAGES)
def test_linked_files_exist(page):
    text = FENCE.sub("", PAGES[page])
    absent = []
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        file = ((ROOT / page).parent / name) if name else ROOT / page
        inside = file.resolve().relative_to(ROOT)
        if inside.parts[0] == PACKAGE.name:  # wherever it is installed
            file = PACKAGE.joinpath(*inside.parts[1:])
        if not file.exists():
            absent.append(target)
        elif anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.M)
            assert anchor in {slug(heading) for heading in headings}, target
    # a picture that is made together with figures, before these are measured
    empty = re.findall(r"<!-- begin (\S+) -->\s*<!-- end \1 -->", text)
    if absent and empty and all(target.endswith(".png") for target in absent):
        pytest.skip(f"to be measured: {', '.join(empty)}; without {', '.join(absent)} until then")
    assert not absent


def slug(heading: str) -> str:
    """A heading's anchor, as hosts of Markdown make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


@pytest.mark.parametrize("page", ["ARCHITECTURE.md", "docs/extending.md"])
def test_files_that_it_names_exist(page):
    files = set(re.findall(r"\w[\w/]*\.(?:py|md)\b", PAGES[page]))
    assert len(files) > 5
    folders = PACKAGE, ROOT, ROOT / "docs"
    assert {name for name in files if not any((f / name).is_file() for f in folders)} == set()


@pytest.mark.parametrize(
    ("page", "text"),
    [(page, text) for page in PAGES for text in blocks(page, "xml")],
    ids=lambda value: value if value in PAGES else "",
)
def test_xml_blocks_set_parameters_that_exist(page, text, some_variant):
    from mitsuba_diffraction.plugin.parameters import NAMES

    root = ElementTree.fromstring(f"<scene>{text}</scene>")
    for plugin, names in NAMES.items():
        for bsdf in root.iterfind(f".//bsdf[@type='{plugin}']"):
            named = {child.get("name") for child in bsdf if child.tag != "bsdf"}
            assert named <= set(names)


TROUBLES = PAGES["docs/troubleshooting.md"]
# Mitsuba's own message
FOREIGN = {'Plugin "diffraction" not found'}


@pytest.fixture(scope="module")
def source() -> str:
    """Code of the package, with literals that continue on the next line joined."""
    code = "".join(path.read_text("utf-8") for path in sorted(PACKAGE.rglob("*.py")))
    return re.sub(r"[\"']\n\s*f?[\"']", "", code)


def test_every_quoted_message_exists(source):
    section = TROUBLES.split("## Messages")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")][1:]
    quoted = [part for row in rows for part in re.findall(r"`([^`]+)`", row)]
    own = [text for text in quoted if text not in FOREIGN]
    fragments = [piece.strip() for text in own for piece in text.split("…")]
    assert len(fragments) > 15
    assert [piece for piece in fragments if piece and piece not in source] == []
