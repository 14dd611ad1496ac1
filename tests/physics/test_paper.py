"""examples/paper: the paper's numbers to the digits it prints, what goes beyond it to its bars, and the command."""

import functools
import importlib
import json
import runpy
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from swarm.run import tiers

ROOT = Path(__file__).parents[2]
# `python -m pytest` has the root on the path, a bare `pytest` has not.
sys.path.append(str(ROOT))
PAPER = ("fig_03", "fig_08_12", "fig_13", "fig_14_17", "fig_19_22")
BEYOND = ("beyond_ellipsoid", "beyond_torus", "beyond_adaptive", "beyond_swarm", "beyond_clearance")
PARTS = {name: importlib.import_module(f"examples.paper.{name}") for name in PAPER + BEYOND}
REFERENCE = json.loads((ROOT / "tests" / "reference" / "paper_examples.json").read_text())

pytestmark = pytest.mark.physics


# The command has ten times as many.
PARTICLES = 1_000


@functools.cache
def numbers(name):
    fewer = mock.patch.multiple(PARTS["beyond_swarm"], PARTICLES=PARTICLES, FEWER=PARTICLES // 10)
    # As with ten times as many, all of them are compiled.
    with fewer, mock.patch.object(tiers, "_FEW", PARTICLES // 100 if name == "beyond_swarm" else tiers._FEW):
        return PARTS[name].numbers()


def assert_reference(loop, name):
    """Every sweep agrees with the iteration in 40-digit arithmetic, up to the round-off of the coordinates."""
    rows = REFERENCE[name]["history"]
    assert len(loop) == len(rows)
    for key in ("multiplier", "force_multiplier", "force_penalty", "kinetic_energy", "constraint"):
        exact = [row[key] for row in rows]
        assert loop[key] == pytest.approx(exact, rel=1e-9, abs=1e-13 * max(exact)), key


# --- The paper, reproduced -------------------------------------------------------------------------------


def test_regularisation():
    fig_03 = PARTS["fig_03"]
    seen = numbers("fig_03")
    assert seen.slopes_at_surface.tolist() == [1.0, 0.0, 0.0, 0.0]
    for a, values in zip(fig_03.EXPONENTS, seen.values, strict=True):
        exact = np.sqrt(2.0 / (a + 1.0)) * np.maximum(seen.gaps, 0.0) ** (0.5 * (a + 1.0))
        assert values == pytest.approx(exact, rel=1e-14, abs=0.0)


def test_state_i_converges_with_a_1_only():
    seen = numbers("fig_08_12")
    assert seen.start.steps == 20
    assert seen.start.position == pytest.approx([0.4, 0.3, 0.0], abs=1e-15)
    assert seen.linear.converged
    assert len(seen.linear) == 13
    assert seen.linear.kinetic_energy[-1] == pytest.approx(0.125, abs=5e-6)
    assert not seen.hertz.converged
    assert len(seen.hertz) == 50
    assert_reference(seen.linear, "state_I_a1")
    assert_reference(seen.hertz, "state_I_a1.5")


def test_the_path_is_reflected():
    fig_13 = PARTS["fig_13"]
    before, after = fig_13.angles(numbers("fig_13"))
    assert before == pytest.approx(after, abs=0.01)
    assert np.linalg.norm(numbers("fig_13").contact, axis=1) == pytest.approx([0.5, 0.5], abs=1e-7)


def test_state_ii_does_not_converge():
    seen = numbers("fig_14_17")
    assert seen.start.steps == 19
    for loop in (seen.linear, seen.hertz):
        assert not loop.converged
        assert len(loop) == 50
        assert loop.kinetic_energy[-1] < 0.03
    assert_reference(seen.linear, "state_II_a1")


def test_ellipsoid_with_the_mean_value_gradient():
    seen, cases = numbers("fig_19_22"), importlib.import_module("examples.paper.cases")
    assert seen.start.steps == 20
    assert not seen.loop.converged
    assert len(seen.loop) == 50
    assert seen.multipliers == pytest.approx(cases.PAPER_MULTIPLIERS, rel=0.0, abs=0.05)
    assert seen.energies == pytest.approx(cases.PAPER_ENERGIES, rel=0.0, abs=0.5e-5)


# --- Beyond the paper ------------------------------------------------------------------------------------


def test_ellipsoid_with_the_composite_gradient():
    part, seen = PARTS["beyond_ellipsoid"], numbers("beyond_ellipsoid")
    assert seen.paper.converged
    assert len(seen.paper) == 4
    assert seen.paper.kinetic_energy[-1] == pytest.approx(0.23999995043, abs=1e-11)
    assert_reference(seen.paper, "ellipsoid_a1_composite")
    assert seen.exact.converged
    assert len(seen.exact) <= 10
    assert part.energy_error(seen.exact) <= 1e-12
    assert not seen.smooth.converged
    assert_reference(seen.smooth, "ellipsoid_a4_composite")


def test_torus():
    part, seen = PARTS["beyond_torus"], numbers("beyond_torus")
    assert all(loop.converged for loop in seen.loops)
    assert max(part.sweeps_at_tolerance(seen)) <= 15
    assert max(len(loop) for loop in seen.loops) <= 45
    assert seen.distances.max() <= 5e-15
    assert part.energy_errors(seen).max() <= 3e-12


def test_adaptive_step_makes_state_ii_state_i():
    part, seen = PARTS["beyond_adaptive"], numbers("beyond_adaptive")
    assert not seen.fixed.converged
    assert seen.paper.converged
    assert len(seen.paper) == 13
    assert seen.paper.kinetic_energy[-1] == pytest.approx(0.125, abs=5e-6)
    assert seen.exact.converged
    assert part.energy_error(seen.exact) <= 1e-12


def test_a_swarm():
    seen = numbers("beyond_swarm")
    loops = seen.long.multipliers
    assert loops.contacts.size == PARTICLES
    assert loops.contacts.min() >= 1000
    assert loops.unconverged.sum() == 0
    assert seen.long.observables["energy_error"].max() <= 1e-11
    # The paper's tolerance is no bar for 1000 impacts: the errors of the contacts add up.
    assert seen.paper.observables["energy_error"].max() >= 1e-3


@pytest.mark.parametrize(
    ("acceleration", "paper", "exact"), [("none", 13.0, 36.0), ("secant", 5.0, 8.0), ("reflection", 1.5, 1.5)]
)
def test_sweeps_of_the_accelerations(acceleration, paper, exact):
    part, seen = PARTS["beyond_swarm"], numbers("beyond_swarm")
    assert part.mean_sweeps(seen.short[acceleration, 1e-10]) <= paper
    assert part.mean_sweeps(seen.short[acceleration, 1e-28]) <= exact
    assert seen.short[acceleration, 1e-28].observables["energy_error"].max() <= 1e-12


@pytest.mark.long
def test_pin_in_a_hole():
    part, seen = PARTS["beyond_clearance"], numbers("beyond_clearance")
    stiff = seen.hertz.result.observables
    assert stiff["energy_error"].max() <= 1e-12
    assert stiff["impacts"][-1] >= 20
    assert stiff["max_penetration"].max() <= 0.01 * part.HEIGHT
    assert abs(part.energy_left(seen.hertz) - 1.0) <= 1e-12
    assert np.abs(seen.hertz.path[2]).max() == 0.0
    # Fixed steps are in State II: they are counted, and lose energy.
    assert seen.uzawa.result.multipliers.unconverged.sum() > 0
    assert part.energy_left(seen.uzawa) < 0.95


# --- The command -----------------------------------------------------------------------------------------


def test_the_command_draws_every_figure(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    # What is drawn of long runs is drawn of short ones too.
    for name, value in (("PARTICLES", 20), ("FEWER", 20), ("UNTIL", 58.0), ("SHORT", 5.0)):
        monkeypatch.setattr(PARTS["beyond_swarm"], name, value)
    monkeypatch.setattr(PARTS["beyond_clearance"], "UNTIL", 2e-3)
    drawn = {
        name: part.numbers() if name in ("beyond_swarm", "beyond_clearance") else numbers(name)
        for name, part in PARTS.items()
        if name != "fig_19_22"
    }
    # The mean-value gradient takes 5 s; the loop of the composite one has as many sweeps.
    loop, sweeps = drawn["beyond_ellipsoid"].smooth, importlib.import_module("examples.paper.cases").PAPER_SWEEPS - 1
    drawn["fig_19_22"] = PARTS["fig_19_22"].Numbers(None, loop, loop.multiplier[sweeps], loop.kinetic_energy[sweeps])
    # All of them before the first is replaced: `numbers` asks the part.
    for part, seen in [(PARTS[name], seen) for name, seen in drawn.items()]:
        monkeypatch.setattr(part, "numbers", functools.partial(lambda seen: seen, seen))
    monkeypatch.setattr(sys, "argv", ["paper", "-o", str(tmp_path / "new")])
    runpy.run_module("examples.paper", run_name="__main__")
    images = sorted(path.name for path in (tmp_path / "new").glob("*.png"))
    assert images == sorted(part.FILE for part in PARTS.values())
    for name in images:
        assert (tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG")
    table = (tmp_path / "new" / "table.md").read_text(encoding="utf-8")
    assert table in capsys.readouterr().out
    for name, part in PARTS.items():
        for row in part.rows(drawn[name]):
            assert row.quantity in table
            assert row.swarm in table


def test_without_matplotlib_the_command_names_the_extra(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["paper"])
    with pytest.raises(SystemExit, match=r"\[plot\]"):
        importlib.import_module("examples.paper.__main__").main()
