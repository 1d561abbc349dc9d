"""Fixtures that every test may use."""

from __future__ import annotations

import collections
import ctypes
import gc
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import hypothesis
import pytest

from tests.support import ROOT

# read when Dr.Jit is imported: kernels of tests are not optimised, the user's have to be
os.environ["DRJIT_CACHE_DIR"] = str(ROOT / ".pytest_cache" / "kernels")

import mitsuba_diffraction  # noqa: F401 - before Dr.Jit: it chooses the LLVM that Dr.Jit loads
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from mitsuba_diffraction.tables.store import VARIABLE
from tests.support.coarse import COARSE, energy_as
from tests.support.command_line import Ran
from tests.support.kernels import Called, called_objects, compile_quickly, transform_once
from tests.support.variants import SOME, VARIANTS, obstacle, use

transform_once()  # before Mitsuba is imported


def pytest_configure(config: pytest.Config) -> None:
    """Allow the package's own warnings, which follow from a test's surface; others are errors."""
    config.addinivalue_line("filterwarnings", "ignore::mitsuba_diffraction.DiffractionWarning")
    if config.getoption("hypothesis_profile", None) is None:
        same_cases_in_every_run()


_THOROUGH = re.compile(r"^pytestmark = \[?\s*pytest\.mark\.thorough", re.M)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Pass over files whose tests would all be deselected: importing them takes seconds."""
    if config.option.markexpr != "not thorough" or collection_path.suffix != ".py":
        return None
    return bool(_THOROUGH.search(collection_path.read_text("utf-8"))) or None


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The cache of tables, for this session alone: tests never touch the user's.

    Workers share it, for the tables of the measured patches above all.
    """
    root = tmp_path_factory.getbasetemp()
    folder = (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / "cache"
    folder.mkdir(exist_ok=True)
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = str(folder)
    yield folder
    if before is None:
        del os.environ[VARIABLE]
    else:
        os.environ[VARIABLE] = before


# the machine may be busy, and a change must not fail by a case that chance finds just then: cases
# are the same in every run; others are looked for by --hypothesis-profile=search, and by make fuzz
_BUSY = {
    "deadline": None,
    "print_blob": True,
    # folders of a test may hold the files of all of its cases
    "suppress_health_check": [
        hypothesis.HealthCheck.too_slow,
        hypothesis.HealthCheck.function_scoped_fixture,
    ],
}
hypothesis.settings.register_profile("search", **_BUSY)
hypothesis.settings.register_profile("tests", **_BUSY, derandomize=True, database=None)
hypothesis.settings.load_profile("tests")


def same_cases_in_every_run() -> None:
    """Keep Hypothesis from trying constants of the modules that other tests happen to import.

    It has no setting for it. In versions that lack the function, a run's cases vary.
    """
    module = "hypothesis.internal.conjecture.providers"
    if hasattr(sys.modules.get(module), "is_local_module_file"):
        sys.modules[module].is_local_module_file = lambda file: False  # type: ignore[attr-defined]


def pytest_collection_finish() -> None:
    """Exempt imported modules from garbage collection, which takes a tenth of the time."""
    import mitsuba  # noqa: F401

    gc.collect()
    gc.freeze()


_left: set[Called] = set()


@pytest.fixture(autouse=True)
def alone() -> None:
    """Without the BSDFs of earlier tests.

    A kernel that calls BSDFs holds the code of all there are: with those of a few tests it takes
    ten times as long to compile, and it is another one whenever tests run in another order.
    """
    global _left
    called = called_objects()
    if called is None:  # a whole collection takes too long before every test
        gc.collect(1)
    elif not called <= _left:  # fixtures hold what the last collection left
        gc.collect()
        _left = called_objects() or set()


@pytest.fixture(scope="session", autouse=True)
def ctrl_c() -> Iterator[None]:
    """Ctrl-C interrupts, also where the tests run in a shell's background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session", autouse=True)
def kept_memory() -> None:
    """Memory of large arrays is used again: giving it back takes a tenth of the tests' time.

    Only where the library of C has the function, as on Linux.
    """
    if sys.platform == "linux" and hasattr(library := ctypes.CDLL(None), "mallopt"):
        for option, value in ((_TRIM_THRESHOLD, 2**30), (_MMAP_THRESHOLD, 2**28), (_ARENAS, 2)):
            library.mallopt(option, value)


# of glibc's malloc.h
_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENAS = -1, -3, -8


@pytest.fixture(scope="session", autouse=True)
def own_vectors() -> int:
    """Compile kernels quickly; returns how many lanes the vectors of child processes have."""
    return compile_quickly()


@pytest.fixture(scope="session", autouse=True)
def coarse() -> Iterator[None]:
    """Energy conserved coarsely: scales as fine as users have them take seconds to find."""
    with energy_as(COARSE):
        yield


@pytest.fixture(scope="module")
def fine(coarse: None) -> Iterator[None]:
    """Energy conserved as finely as users have it, for modules that ask how well it is."""
    with energy_as(EnergySettings()):
        yield


@pytest.fixture(scope="session")
def gentle(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Parameters of a scene whose patch is `gentle_patch`."""
    from tests.support.scenes import gentle_patch

    return gentle_patch(tmp_path_factory.mktemp("patch"))


@pytest.fixture(scope="session")
def shared_afm() -> Path:
    """Folder of measured patches kept outside the project; tests that need it skip without it."""
    folder = ROOT.parent / "shared" / "afm"
    if not folder.is_dir():
        pytest.skip(f"measured patches are not here: {folder}")
    return folder


@pytest.fixture(scope="session", params=VARIANTS)
def working_variant(request: pytest.FixtureRequest) -> str:
    """Name of a variant of the plugin that runs on this machine."""
    name: str = request.param
    if reason := obstacle(name):
        pytest.skip(reason)
    return name


@pytest.fixture
def variant(working_variant: str) -> str:
    """Every working variant in turn, set: another test may have set another."""
    return use(working_variant)


@pytest.fixture
def some_variant() -> str:
    """The first working variant, set: for what does not depend on which it is."""
    return use(*VARIANTS)


@pytest.fixture
def spectral() -> None:
    """The variant llvm_ad_spectral, which commands that measure set by its name, set."""
    use("llvm_ad_spectral")


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    """`run(*arguments)`: main() in this process."""

    from mitsuba_diffraction.cli import main

    def call(*arguments: object) -> Ran:
        code = main([str(a) for a in arguments])
        return Ran(code, *capfd.readouterr())

    return call


@pytest.fixture
def scene(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The module's SCENE as room.xml, in a folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "room.xml"
    file.write_text(request.module.SCENE)
    return file


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Count the skipped tests by reason, all variants of a backend in one line."""
    counts: collections.Counter[str] = collections.Counter()
    for report in terminalreporter.getreports("skipped"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longreprtext
        reason = re.sub(r"\b(cuda|llvm|scalar)_\w+", r"\1_*", reason.removeprefix("Skipped: "))
        counts[reason] += 1
    for reason, count in counts.most_common():
        terminalreporter.write_line(f"skipped {count:4d}: {reason}")


@pytest.fixture(scope="module", params=SOME)
def one_of_some(request: pytest.FixtureRequest) -> str:
    """Name of a variant: tests of a module follow in its order, a change takes 0.1 s."""
    return use(request.param)


@pytest.fixture
def every_variant(one_of_some: str) -> str:
    """A variant of each backend, way of colour and polarisation in turn, set."""
    return use(one_of_some)
