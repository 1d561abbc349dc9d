"""The option --processor-time: processor seconds of every folder and of the dearest files.

Other programs do not lengthen processor time. Child processes count: workers, browsers, commands.
"""

from __future__ import annotations

import collections
import os
from collections.abc import Iterator

import pytest

_START = "start and collection"
_FILES = 25

_last = 0.0
_spent: collections.Counter[str] = collections.Counter()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option."""
    parser.addoption(
        "--processor-time", action="store_true", help="print processor seconds by folder and file"
    )


def processor_seconds() -> float:
    """Seconds of this process, of its former children, and of all that descend from it now."""
    import psutil

    seconds = sum(os.times()[:4])
    for child in psutil.Process().children(recursive=True):
        try:
            seconds += sum(child.cpu_times()[:4])
        except psutil.NoSuchProcess:
            continue
    return seconds


def since_last() -> float:
    """Seconds since the last call, or the start."""
    global _last
    # a child that died between two calls, reaped by no one here, takes its seconds along
    now = max(_last, processor_seconds())
    seconds, _last = now - _last, now
    return seconds


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Tell a test the seconds from its set-up to its end, and the first of all those before."""
    if item.config.getoption("--processor-time"):
        before = since_last()
        if before > 0.5:
            item.user_properties.append((_START, before))
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Add the seconds to the report of the end, which a worker sends."""
    report = yield
    if call.when == "teardown" and item.config.getoption("--processor-time"):
        report.user_properties.append(("processor time", since_last()))
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the seconds of a test; where workers run tests, this is their parent."""
    if report.when == "teardown":
        for name, seconds in report.user_properties:
            _spent[_START if name == _START else report.nodeid.split("::")[0]] += seconds


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print folders, then the dearest files."""
    if not terminalreporter.config.getoption("--processor-time"):
        return
    folders: collections.Counter[str] = collections.Counter()
    for file, seconds in _spent.items():
        folders[os.sep.join(file.split("/")[:2])] += seconds
    terminalreporter.section(f"processor time: {sum(folders.values()):.0f} s")
    for counts in (folders.most_common(), _spent.most_common(_FILES)):
        for name, seconds in counts:
            terminalreporter.write_line(f"{seconds:8.1f} s  {name}")
        terminalreporter.write_line("")
