"""Processor time of each test: `python -m pytest -n 2 -m "not long" -p tests.durations` writes those that are slow.

With an empty cache of kernels: a test pays for those that it is the first to need. conftest.py marks what is in the
file as slow, and starts with the longest. A file that is not measured yet is there with `null`: its tests count as slow
until they are.
"""

import collections
import json
import os
from pathlib import Path

import pytest

FILE = Path(__file__).with_suffix(".json")
# From here on a test is slow [s].
SLOW = 0.2
# Of a file of slow tests alone the shortest is in the quick ring as well, if it takes less than this [s].
AT_LEAST_ONE = 1.0
_spent = {}


def known():
    """The seconds of slow tests by their ids, and the files that are not measured yet."""
    table = json.loads(FILE.read_text("utf-8")) if FILE.exists() else {}
    seconds = {f"{path}::{name}": time for path, names in table.items() for name, time in (names or {}).items()}
    return seconds, {path for path, names in table.items() if names is None}


def slow_ones(names):
    """Which of the tests of whole files are slow, by their ids."""
    seconds, unmeasured = known()
    files = {}
    for name in names:
        files.setdefault(name.partition("::")[0], set()).add(name)
    slow = set()
    for file, tests in files.items():
        some = tests if file in unmeasured else tests & seconds.keys()
        shortest = min(some & seconds.keys(), key=lambda name: (seconds[name], name), default=None)
        if some == tests and shortest is not None and seconds[shortest] < AT_LEAST_ONE:
            some = some - {shortest}
        slow |= some
    return slow


def order(items, seconds):
    """A key that sorts by the times of files, and within a file by that of each test, the longest first."""
    of_files = collections.Counter()
    for item in items:
        of_files[item.path] += seconds.get(item.nodeid, 0.0)
    return lambda item: (-of_files[item.path], item.path, -seconds.get(item.nodeid, 0.0))


def _processor_time():
    """Of this process, of its children that ended, and of those that run, as the one of children.py, with theirs."""
    own, ticks = sum(os.times()[:4]), os.sysconf("SC_CLK_TCK")
    for child in Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split():
        fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
        own += sum(map(int, fields[11:15])) / ticks
    return own


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Set-up of fixtures is part of the first test that needs them."""
    item.user_properties.append(("began", _processor_time()))
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if call.when == "teardown":
        report.user_properties.append(("ended", _processor_time()))
    return report


def pytest_runtest_logreport(report):
    times = dict(report.user_properties)
    if "ended" in times:
        _spent[report.nodeid] = times["ended"] - times["began"]


def pytest_sessionfinish(session):
    """What was not run keeps its time."""
    if hasattr(session.config, "workerinput") or not _spent:
        return
    write(_spent)


def write(spent):
    """Write the times [s] of tests, by their ids, into the table."""
    seconds, unmeasured = known()
    seconds |= spent
    table = dict.fromkeys(unmeasured - {name.partition("::")[0] for name in spent})
    for name in (name for name, time in seconds.items() if time >= SLOW):
        file, _, test = name.partition("::")
        table[file] = {**(table.get(file) or {}), test: round(seconds[name], 1)}
    FILE.write_text(json.dumps(table, indent=1, ensure_ascii=False, sort_keys=True) + "\n", encoding="utf-8")
