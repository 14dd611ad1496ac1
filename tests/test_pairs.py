"""The matrix of pairs: each cell works, or is refused with the sentence of the committed list."""

import dataclasses
import importlib.util
import itertools
import re
import sys
from pathlib import Path

import durations
import pytest

from bench import cells, outcomes
from bench.cells import Cell
from swarm.fleet import shards
from swarm.fleet.sharded_run import Sharded
from swarm.run.preflight import knows

FOLDER = Path(__file__).parent / "reference"
_SPEC = importlib.util.spec_from_file_location("pairs", FOLDER / "pairs.py")
pairs = importlib.util.module_from_spec(_SPEC)
sys.modules["pairs"] = pairs
_SPEC.loader.exec_module(pairs)

SOON = pairs.soon()


def test_the_list_has_every_cell():
    assert set(pairs.KNOWN) == {str(cell) for cell in cells.CELLS}


def test_no_cell_has_a_third_outcome():
    assert [name for name, word in pairs.KNOWN.items() if word == "third"] == []


def test_every_row_and_column_is_in_the_quick_ring():
    slow = durations.known()[0]
    quick = [cell for cell in SOON if f"tests/test_pairs.py::test_a_cell_is_as_the_list_says[{cell}]" not in slow]
    assert len(quick) < len(SOON)  # the table has these ids
    for names, k in ((cells.ENGINES, 0), (cells.WALLS, 1), (cells.CAPABILITIES, 2)):
        assert {cell[k] for cell in quick} == set(names)


def pattern(sentence):
    """A sentence of `knows` as a regular expression, in which anything may stand for a field.

    What stands between two fields is looked for once, from the left: to go back would find nothing more, and takes
    20 s where a field is the list of the parts of a wall.
    """
    first, *others = (re.escape(text) for text in re.split(r"{[^{}]*}", sentence))
    return "".join([first, *(f"(?>.*?{text})" for text in others[:-1]), *(f".*{text}" for text in others[-1:])])


# What a surface, particles or a scene refuse by themselves, before there is a run.
BY_ITSELF = (
    "spin must be None without a radius, .*", r"(mass|inertia|motion|rotation) must be None for \w+, .*",
    r"mass must be None where an inertia is given to a \w+, .*",
    "motion must be None, a Translation or a Guide where a mass is given, .*", "openings must be of a wall at rest, .*",
    "(motion|mass|inertia) must be left out for Spheres with side=.*", 'side must be "(inside|outside)" for .*',
    r"surfaces\[0\].mass and inertia must be None where the scene has a period, .*",
    r"surfaces\[0\] must be the only surface of a scene without a period, .*",
    r"surfaces\[\d\]( \(\w+\))? must (stand upright on the plane|be bounded along) .*",
    r"surfaces\[\d\] must be one that particles with a radius may meet, .*",
)  # fmt: skip
DECLARED = [pattern(text.sentence()) for one in knows.CAPABILITIES for text in one.refused.values()]


def is_declared(sentence):
    """Whether a refusal is a sentence of the table of engines, or of what a run is made of."""
    return any(re.fullmatch(known, sentence, re.DOTALL) for known in (*DECLARED, *BY_ITSELF))


def require_sentence(cell, sentence):
    """A refusal is declared, and says what it said."""
    assert is_declared(sentence), (cell, sentence)
    assert pairs.digest_of(sentence) == pairs.REFUSALS[str(cell)], (cell, sentence)


def test_what_is_declared_is_as_it_was():
    """A sentence that changes changes refusals.json too: `python tests/reference/pairs.py --write declared`."""
    assert pairs.declared() == pairs.DECLARED


def test_each_refusal_has_a_digest():
    assert set(pairs.REFUSALS) == {name for name, word in pairs.KNOWN.items() if word == "refused"}


# For each engine a wall that is itself refused with it, or with some of the capabilities.
ROWS = dict(zip(cells.ENGINES, (
    "prism", "paraboloid", "union", "foam", "stadium", "polygon", "slab", "intersection",
), strict=True))  # fmt: skip


@pytest.mark.parametrize("engine", cells.ENGINES)
def test_a_row_is_refused_with_the_sentences_that_it_had(engine):
    for capability in cells.CAPABILITIES:
        cell = Cell(engine, ROWS[engine], capability)
        if pairs.KNOWN.get(str(cell)) == "refused":
            outcome = outcomes.outcome(cell)
            assert outcome.what == "refused", (cell, outcome)
            require_sentence(cell, outcome.said)


def test_a_sentence_that_changes_is_seen_and_the_folder_of_a_log_is_not():
    known = knows.CAPABILITIES[-2]
    (engines, one), *_ = known.refused.items()
    changed = known._replace(refused={engines: one._replace(remedy="run it here")})
    assert pairs.digest_of(changed.sentence(engines[0])) != pairs.DECLARED[engines[0]][known.name]
    refusal = "impacts must be None with a cluster, got {}impacts.h5: its shards"
    assert pairs.digest_of(refusal.format("/tmp/tmpa1/")) == pairs.digest_of(refusal.format(""))


@pytest.mark.parametrize("cell", SOON, ids=str)
def test_a_cell_is_as_the_list_says(cell):
    outcome = outcomes.outcome(cell)
    assert (outcome.what, outcome.said) == (pairs.KNOWN[str(cell)], outcome.said)
    if outcome.what == "refused":
        require_sentence(cell, outcome.said)


def pairs_of(chosen):
    """Each pair of two names that occurs in a cell."""
    return {pair for cell in chosen for pair in itertools.combinations(enumerate(cell), 2)}


# Engines that ask walls in every step, or for each ball anew: a run takes 0.2 to 7 s, and one of the others 0.1 s.
ASKING_OFTEN = (
    "bodies, Impact", "points, Penalty", "grains, Penalty", "points, AugmentedLagrangian", "balls, heavy wall",
)  # fmt: skip
# Walls whose push or way is found by iteration: such a run takes up to 15 s.
SLOW_TO_ASK = ("formula", "mesh", "own surface", "polygon", "prism", "sampled", "stadium")


def cover():
    """Cells in which each pair of an engine, a wall and a capability occurs that occurs at all.

    The quick ring has each pair of an engine and a capability. Those that ask walls often are at each wall once more,
    with a capability that changes from wall to wall, or plain where the wall is slow to ask. All else is for the
    others, which change as well. A cell that works says more than one that is refused.
    """
    known, names, chosen = set(cells.CELLS), list(cells.CAPABILITIES), list(SOON)
    found, seldom = pairs_of(SOON), [engine for engine in cells.ENGINES if engine not in ASKING_OFTEN]

    def take(turn, is_wanted):
        """The first cell of a turn that is wanted and works, or else the first that is wanted, or is there at all."""
        turn = sorted((cell for cell in turn if cell in known), key=lambda one: pairs.KNOWN[str(one)] != "works")
        one = next(filter(is_wanted, turn), turn[0] if turn else None)
        if one is not None:
            found.update(pairs_of([one]))
            chosen.append(one)

    for w, wall in enumerate(cells.WALLS):
        is_slow = wall in SLOW_TO_ASK
        for e, engine in enumerate(ASKING_OFTEN):
            if ((0, engine), (1, wall)) not in found:
                first = 0 if is_slow else (w + 7 * e) % len(names)
                turn = [Cell(engine, wall, name) for name in (*names[first:], *names[:first])]
                take(turn, lambda one, slow=is_slow: slow or ((1, one.wall), (2, one.capability)) not in found)
        for c, name in enumerate(names):
            if ((1, wall), (2, name)) not in found:
                first = (w + c) % len(seldom)
                take([Cell(one, wall, name) for one in (*seldom[first:], *seldom[:first], *ASKING_OFTEN)], bool)
    for cell in cells.CELLS:
        if not pairs_of([cell]) <= found:
            take([cell], bool)
    return list(dict.fromkeys(chosen))


COVER = cover()


def test_the_slow_ring_has_every_pair():
    assert pairs_of(COVER) == pairs_of(cells.CELLS)
    assert len(COVER) < 0.25 * len(cells.CELLS)


@pytest.mark.slow
@pytest.mark.parametrize("wall", cells.WALLS)
def test_a_cell_of_each_pair_is_as_the_list_says(wall):
    require_as_listed([cell for cell in COVER if cell[1] == wall and cell not in SOON])


@pytest.mark.long
@pytest.mark.parametrize("wall", cells.WALLS)
@pytest.mark.parametrize("engine", cells.ENGINES)
def test_all_cells_of_a_row_are_as_the_list_says(engine, wall):
    require_as_listed([cell for cell in cells.CELLS if cell[:2] == (engine, wall) and cell not in SOON])


def require_as_listed(row):
    found = {str(cell): outcomes.outcome(cell) for cell in row}
    assert [(name, *one) for name, one in found.items() if one.what != pairs.KNOWN[name]] == []
    for name, one in found.items():
        if one.what == "refused":
            require_sentence(name, one.said)


# --- The table of the guide ------------------------------------------------------------------------------

ENGINES = dict(zip(cells.ENGINES, (
    knows.POINTS, knows.BALLS, knows.BODIES, knows.SOFT, knows.GRAINS, knows.PAPER, knows.MASSIVE, knows.HEAVY,
), strict=True))  # fmt: skip
SUPPORTED = {
    "restitution": "restitution", "friction": "friction", "temperature": "temperature", "Lambert": "law of a wall",
    "Sticky": "wait", "counters": "counter", "source": "source", "log": "log of impacts", "opening": "opening",
    "timed opening": "opening for a time", "present": "present", "period": "period", "plane": "plane", "spin": "spin",
    "translation": "motion", "turning": "rotation", "mass": "mass of a wall", "member impacts": "impacts on members",
    "pair restitution": "law of pairs", "pair friction": "law of pairs", "contact duration": "contact duration",
}  # fmt: skip
OF_WALLS = {"union": "union", "field": "field", "mesh": "mesh or outline", "prism": "mesh or outline"}


@pytest.mark.parametrize("engine", cells.ENGINES)
def test_the_table_says_yes_where_a_cell_works(engine):
    known = {tuple(name.split(" / ")[1:]): word for name, word in pairs.KNOWN.items() if name.startswith(f"{engine} /")}
    asked = {one: name for one, name in SUPPORTED.items() if one in {capability for _wall, capability in known}}
    heavy = "mass" in cells.ENGINES[engine].laws
    for one, name in asked.items():
        # Points wait at other walls than that with the mass, which that of the cells is.
        if heavy and name == "wait":
            continue
        works = any(word == "works" for (_wall, capability), word in known.items() if capability == one)
        assert works == (knows.sentence(ENGINES[engine], name) is None), one
    for wall, name in OF_WALLS.items():
        if wall == "union" and engine == "points, heavy wall":
            # Beside a wall with a mass points meet unions; the cell is of a union that impacts move.
            assert known[wall, "plain"] == "refused"
            continue
        assert (known[wall, "plain"] == "works") == (knows.sentence(ENGINES[engine], name) is None), wall


# --- The judge -------------------------------------------------------------------------------------------


def test_a_capability_that_is_ignored_is_a_third_outcome(monkeypatch):
    ignored = cells.CAPABILITIES["restitution"]._replace(edit=cells.nothing)
    monkeypatch.setitem(cells.CAPABILITIES, "restitution", ignored)
    outcome = outcomes.outcome(Cell("points, Impact", "box", "restitution"))
    assert (outcome.what, outcome.said) == ("third", "ignored: dissipated_energy is 0")


def test_a_crash_is_a_third_outcome(monkeypatch):
    monkeypatch.setitem(cells.WALLS, "box", cells.WALLS["box"]._replace(make=lambda *_given: 1 / 0))
    assert outcomes.outcome(Cell("points, Impact", "box", "plain")).said == "ZeroDivisionError: division by zero"


def test_books_that_do_not_balance_are_a_third_outcome(monkeypatch):
    run = outcomes.run

    def wrong(*given):
        done = run(*given)
        done.result.observables["dissipated_energy"][-1] *= 1.0 + 1e-9
        return done

    monkeypatch.setattr(outcomes, "run", wrong)
    assert outcomes.outcome(Cell("points, Impact", "box", "friction")).said.startswith("the energy is off by")


def test_a_particle_outside_is_a_third_outcome(monkeypatch):
    run = outcomes.run

    def wrong(*given):
        done = run(*given)
        done.result.particles.position[0, 1] += 1.0
        return done

    monkeypatch.setattr(outcomes, "run", wrong)
    assert "outside" in outcomes.outcome(Cell("points, Impact", "sphere", "plain")).said


def test_a_run_in_shards_has_two_and_other_bits_are_a_third_outcome(monkeypatch):
    """The random numbers of a shard are those of its own particles: of the first ones they are others."""
    cell, begin, counts = Cell("points, Impact", cells.ON_A_CLUSTER, "temperature"), Sharded.begin, []

    def counted(*given):
        folder, bounds = begin(*given)
        counts.append(len(bounds) - 1)
        return folder, bounds

    monkeypatch.setattr(Sharded, "begin", counted)
    assert outcomes.outcome(cell) == ("works", "")
    assert counts == [2]
    task_of = shards.task_of
    monkeypatch.setattr(
        shards,
        "task_of",
        lambda folder, k: dataclasses.replace(task_of(folder, k), first=0),
    )
    assert outcomes.outcome(cell).said.startswith("on a cluster ")
