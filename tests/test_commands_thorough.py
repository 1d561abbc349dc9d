"""The commands that README, docs and notebooks show run, in order, on small patches and pictures.

What is not run here: the gallery's, whose scenes test_scenes_thorough.py renders; `make`, `pip` and
`apt`, which set up what runs these tests; `view`, which opens a window; `tradeoff`, `compare`,
`plan` and `solve --crossed`, which take long at their smallest, and are run smaller still by their
own tests.
`render --denoise` runs without it. test_docs.py checks what these would be given.
"""

from __future__ import annotations

import pytest

from tests.support.commands import commands, run_page, small_tree
from tests.support.pages import PAGES

pytestmark = [
    pytest.mark.thorough,
    # heights as coarse and steep as the stand-ins' are worth a warning
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("some_variant"),
]


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return small_tree(tmp_path_factory.mktemp("clone"))


@pytest.mark.parametrize("page", [p for p in PAGES if p != "docs/gallery.md" and commands(p)])
def test_the_commands_of_a_page_run(page, tree, monkeypatch):
    run_page(page, tree, monkeypatch)
