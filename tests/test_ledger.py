"""Plain Python is counted over all runs of a process, and what was worth compiling is known to the next process."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from conftest import LEDGER

import swarm
from swarm.kernel import cache
from swarm.run import ledger, tiers
from swarm.run.engine import Run
from swarm.run.tiers import Tier

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: there is one tier")
PATIENCE = 8.0
SPHERE = swarm.Scene([swarm.Sphere(0.5)])


@pytest.fixture(autouse=True)
def new_process(monkeypatch, tmp_path):
    """An empty ledger, and no kernel that is compiled."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(ledger, "_spent", {})
    for name, function in LEDGER.items():
        monkeypatch.setattr(ledger, name, function)
    monkeypatch.setattr(tiers, "_PATIENCE", PATIENCE)
    monkeypatch.setattr(cache, "is_compiled", lambda kernel, arguments: False)
    monkeypatch.setattr(cache, "is_being_compiled", lambda kernel, arguments: False)


def tier_of(*kernels, choice="auto", numbers=()):
    """The tier of a run that calls these kernels; a call stands for its kind."""
    tier = Tier(choice, numbers, 3)
    tier.choose([(kernel, ()) for kernel in kernels])
    return tier


@pytest.fixture
def _named(monkeypatch):
    monkeypatch.setattr(cache, "kind", lambda kernel, arguments: kernel)


@pytest.mark.usefixtures("_named")
def test_the_time_of_all_runs_of_a_kind_counts():
    for remaining in (8.0, 5.0, 2.0):
        tier = tier_of("fly", "observe")
        assert tier.is_plain
        assert tier.remaining == remaining
        tier.spend(3.0)
    assert not tier_of("fly", "observe").is_plain


@pytest.mark.usefixtures("_named")
def test_other_kinds_have_time_of_their_own():
    tier_of("fly", "observe").spend(7.0)
    # What both need is missing for longer: it is compiled with what is used as long.
    assert tier_of("other", "observe").remaining == 8.0
    assert tier_of("fly").remaining == 1.0
    # A run that meets another kind has no more time than it had.
    tier = tier_of("fly")
    tier.choose([("fly", ()), ("slide", ())])
    assert tier.remaining == 1.0


@pytest.mark.usefixtures("_named")
@pytest.mark.parametrize(("choice", "plain"), [("always", False), ("never", True)])
def test_what_is_chosen_by_hand_counts_nothing(choice, plain):
    tier_of("fly").spend(20.0)
    tier = tier_of("fly", choice=choice)
    assert tier.is_plain is plain
    tier.spend(20.0)
    assert ledger.spent(["fly"]) == 20.0


@pytest.mark.usefixtures("_named")
def test_what_runs_compiled_counts_nothing(monkeypatch):
    monkeypatch.setattr(cache, "is_compiled", lambda kernel, arguments: True)
    tier_of("fly").spend(20.0)
    assert ledger.spent(["fly"]) == 0.0


@pytest.mark.usefixtures("_named")
def test_the_next_process_compiles_at_once_what_was_worth_it(monkeypatch):
    tier = tier_of("fly", "observe")
    tier.spend(7.0)
    assert tier_of("fly", "observe").is_plain
    assert not ledger.is_remembered(["fly"])
    tier = tier_of("fly", "observe")
    tier.spend(7.0)
    tier.choose([("fly", ()), ("observe", ())])
    assert not tier.is_plain
    monkeypatch.setattr(ledger, "_spent", {})
    assert not tier_of("fly", "observe").is_plain
    assert tier_of("fly", "other").remaining == 8.0


@pytest.mark.usefixtures("_named")
@pytest.mark.parametrize("choice", ["auto", "always"])
def test_what_was_not_worth_it_is_not_remembered(choice):
    """Bodies, and functions whose last bit may differ, are compiled at once, whatever they cost."""
    tier = tier_of("fly", choice=choice)
    tier.remaining = 0.0
    tier.choose([("fly", ())])
    assert not tier.is_plain
    assert not ledger.is_remembered(["fly"])


@pytest.mark.usefixtures("_named")
def test_a_folder_that_takes_nothing_fails_no_run(tmp_path):
    (tmp_path / "cache").write_text("no folder")
    for plain in (True, False):
        tier = tier_of("fly")
        assert tier.is_plain is plain
        tier.spend(20.0)
    assert not ledger.is_remembered(["fly"])


@compiled_only
def test_the_second_run_is_compiled_from_the_start(monkeypatch):
    """By the time that `Run` books: here any time is enough."""
    monkeypatch.setattr(tiers, "_PATIENCE", 1e-9)
    start = swarm.fill(SPHERE, 3, speed=1.0, seed=1)
    with Run(SPHERE, start.copy(), swarm.Impact(), 1, None, "auto") as run:
        assert run._tier.is_plain
        run.observe()
    assert not Run(SPHERE, start.copy(), swarm.Impact(), 1, None, "auto")._tier.is_plain


KINDS = """
import swarm
from swarm.run import ledger
from swarm.run.engine import Run
for radius, method in ((0.5, swarm.Impact()), (0.7, swarm.Impact()), (0.5, swarm.Penalty(dt=1e-3, penalty=1e4))):
    scene = swarm.Scene([swarm.Sphere(radius)])
    run = Run(scene, swarm.Particles((0, 0, 0), (1, 0, 0)), method, 1, None, "auto")
    print(*(ledger._path(kind).name for kind in run._tier._missing))
"""


@compiled_only
def test_kinds_have_the_same_names_in_every_process(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(Path(swarm.__file__).parents[1])}
    told = [
        subprocess.run(
            [sys.executable, "-c", KINDS],
            env={**environment, "PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True,
        ).stdout.splitlines()
        for seed in ("1", "2")
    ]  # fmt: skip
    assert told[0] == told[1]
    first, other_size, other_method = (set(line.split()) for line in told[0])
    assert first == other_size
    assert len(first) == 2
    assert not first & other_method
