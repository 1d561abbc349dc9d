"""Count words of prose, and phrases without a technical noun, page by page.

python -m docs.make.words             # pages, then docstrings and messages
python -m docs.make.words --before COMMIT    # beside the counts of a commit
python -m docs.make.words --sample SEED      # twenty docstrings, ten messages, five paragraphs

Code blocks, tables, generated parts, formulas and pictures are left out. Pages of docs/validation
and front.md are written by docs/make/validation; their prose counts.
"""

from __future__ import annotations

import argparse
import ast
import random
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]

#: Phrases that stand where the field has a noun.
PHRASES = {
    "what is": re.compile(r"\bwhat (?:is|are|was|it|they)\b", re.I),
    "that is no": re.compile(r"\b(?:is|are|was|were) no(?:ne)?\b", re.I),
    "of it": re.compile(r"\bof (?:it|them)\b", re.I),
    "those of": re.compile(r"\b(?:those|that) of\b", re.I),
    "nothing": re.compile(r"(?:^|[.:;] )nothing\b", re.I),
}

_NOT_PROSE = (
    re.compile(r"<!-- begin (\S+) -->.*?<!-- end \1 -->", re.S),
    re.compile(r"^ *```.*?^ *```$", re.M | re.S),
    re.compile(r"\$\$.*?\$\$", re.S),
    re.compile(r"^ *\|.*$", re.M),
    re.compile(r"!\[[^\]]*\]\([^)]*\)"),
    re.compile(r"<!--.*?-->", re.S),
)


def prose(page: str) -> str:
    """Return the sentences of a page in Markdown: links by their text, code spans included."""
    for part in _NOT_PROSE:
        page = part.sub(" ", page)
    return re.sub(r"\]\([^)]*\)", "]", page)


def words(page: str) -> int:
    """Return the number of words of a page's prose."""
    return sum(any(c.isalnum() for c in word) for word in prose(page).split())


def phrases(text: str) -> Counter[str]:
    """Return how often each of `PHRASES` occurs."""
    return Counter({name: len(found.findall(text)) for name, found in PHRASES.items()})


def code_texts(source: str) -> Iterator[str]:
    """Yield docstrings, and strings of more than three words, of a module's syntax tree."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = " ".join(node.value.split())
            if text.count(" ") > 2:
                yield text


def is_page(path: str) -> bool:
    """Whether a path of the repository is a page that readers open."""
    inside = path.startswith("docs/") and not path.startswith("docs/make/")
    return path.endswith(".md") and (inside or path in ("README.md", "ARCHITECTURE.md"))


def files(commit: str | None) -> dict[str, str]:
    """Return the text of each page and module, of the working tree or of a commit."""
    listing = ["git", "ls-files"] if commit is None else ["git", "ls-tree", "-r", "--name-only"]
    names = _git(*listing[1:], *([commit] if commit else [])).splitlines()
    wanted = [n for n in names if is_page(n) or re.match(r"_?mitsuba_diffraction.*\.py$", n)]
    if commit is None:
        return {n: (ROOT / n).read_text("utf-8") for n in wanted if (ROOT / n).exists()}
    return {name: _git("show", f"{commit}:{name}") for name in wanted}


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True)
    return done.stdout.decode("utf-8")


def counts(texts: Mapping[str, str]) -> tuple[dict[str, int], Counter[str], Counter[str]]:
    """Return words of each page, phrases of the pages, and phrases of the code."""
    pages = {name: text for name, text in texts.items() if is_page(name)}
    modules = (text for name, text in texts.items() if not is_page(name))
    in_pages = sum((phrases(prose(text)) for text in pages.values()), Counter())
    in_code = sum((phrases(t) for text in modules for t in code_texts(text)), Counter())
    return {name: words(text) for name, text in pages.items()}, in_pages, in_code


def public_docstrings(source: str) -> Iterator[str]:
    """Yield the name and docstring of each public function, class and module of a source."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            name, text = getattr(node, "name", "module"), ast.get_docstring(node)
            if text and not name.startswith("_"):
                yield f"{name}: {text}"


def messages(source: str) -> Iterator[str]:
    """Yield the expressions that a source raises as errors, or warns of."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and re.search(r"Error$|warn", ast.unparse(node.func)):
            call = ast.unparse(node)
            if any(code_texts(call)):
                yield call


def sample(texts: Mapping[str, str], seed: int) -> Iterator[str]:
    """Yield twenty docstrings, ten messages and five paragraphs, drawn without order."""
    pages = sorted(name for name in texts if is_page(name))
    modules = sorted(name for name in texts if not is_page(name))
    paragraphs = (
        f"{name}: {' '.join(text.split())}"
        for name in pages
        for text in re.split(r"\n\s*\n", prose(texts[name]))
        if words(text) > 15
    )
    docstrings = (f"{name}: {t}" for name in modules for t in public_docstrings(texts[name]))
    raised = (f"{name}: {t}" for name in modules for t in messages(texts[name]))
    draw = random.Random(seed)
    for count, kind in ((20, docstrings), (10, raised), (5, paragraphs)):
        yield from draw.sample(list(kind), count)


def main() -> int:
    """Print the counts as Markdown tables, or a sample of texts."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.words", description=__doc__)
    parser.add_argument("--before", metavar="COMMIT", help="counts of a commit beside today's")
    parser.add_argument("--sample", metavar="SEED", type=int, help="texts to read, drawn by a seed")
    args = parser.parse_args()
    if args.sample is not None:
        print("\n\n".join(sample(files(None), args.sample)))
        return 0
    found = [counts(files(commit)) for commit in ([args.before] if args.before else []) + [None]]
    columns = (["before"] if args.before else []) + ["words"]
    print(f"| page | {' | '.join(columns)} |\n|---|{'---:|' * len(columns)}")
    for name in sorted({name for pages, _, _ in found for name in pages}):
        print(f"| {name} | {' | '.join(str(pages.get(name, '–')) for pages, _, _ in found)} |")
    print(f"| all | {' | '.join(str(sum(pages.values())) for pages, _, _ in found)} |\n")
    print(f"| phrase | {' | '.join(f'pages {c} | code {c}' for c in columns)} |")
    print(f"|---|{'---:|' * 2 * len(columns)}")
    for name in PHRASES:
        row = (str(found[name]) for _, *both in found for found in both)
        print(f"| {name} | {' | '.join(row)} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
