"""Random sources x ends of intervals x ends of runs: births are in [start, stop), and no frame depends on `until`.

A failure prints its seed; `check_births(seed)` and `check_frames(seed)` repeat it.
"""

import math

import numpy as np
import pytest

import swarm
from swarm.sources.births import with_births

SCENE = swarm.Scene([swarm.Box((0.5, 0.5, 0.5))], (0.0, 0.0, -1.0))
KINDS = ("rate", "rate and count", "even", "even and count", "times", "count", "count at once")
LONGEST = 3.0
START = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])


def a_source(random, kind):
    """A source whose interval begins or ends at a frame, at a birth, beside one, or anywhere."""
    rate = float(random.choice([3.0, 10.0, 30.0, 7.3, random.uniform(1.0, 40.0)]))
    start = float(random.choice([0.0, 0.1, 0.25, 0.3, random.uniform(0.0, 1.0)]))
    births = int(random.integers(1, 40))
    at = start + births / rate
    stop = float(random.choice([1.0, 1.5, at, np.nextafter(at, 0.0), np.nextafter(at, 9.0), at + random.uniform()]))
    stop = max(stop, start)
    given = {"speed": 1.0} if random.random() < 0.5 else {"temperature": 0.5}
    if kind == "times":
        times = random.choice([0.0, 0.25, 0.3, 1.0, 1.5, *random.uniform(0.0, 2.0, 5)], random.integers(1, 30))
        return swarm.Source(0, times=times.tolist(), **given)
    if kind.startswith("count"):
        stop = start if kind == "count at once" else max(stop, start + 0.1)
        return swarm.Source(0, count=births, start=start, stop=stop, **given)
    ends = None if random.random() < 0.3 else stop
    most = births if "count" in kind else None
    return swarm.Source(0, rate=rate, even="even" in kind, count=most, start=start, stop=ends, **given)


def births_of(source, seed, until):
    return with_births(SCENE, START, (source,), seed, until)


def times_of(particles):
    """Behind the particle of the start."""
    return np.array(particles.births.time[1:])


def check_births(seed):
    random = np.random.default_rng([10, seed])
    kind = KINDS[seed % len(KINDS)]
    source = a_source(random, kind)
    case = f"seed {seed}: {source}"
    whole = births_of(source, seed, LONGEST)
    times = times_of(whole)
    stop = math.inf if source.stop is None else source.stop
    assert (np.diff(times) >= 0.0).all(), case
    assert (times <= LONGEST).all(), case
    if kind == "times":
        assert times.tolist() == sorted(source.times), case
    else:
        assert (times >= source.start).all(), case
        assert (times == source.start).all() if kind == "count at once" else (times < stop).all(), case
        assert source.count is None or len(times) <= source.count, case
    if kind in ("count", "count at once") and stop <= LONGEST:
        assert len(times) == source.count, case
    if "even" in kind and len(times):
        most = math.inf if source.count is None else source.count
        np.testing.assert_allclose(times, source.start + np.arange(len(times)) / source.rate, rtol=1e-14, err_msg=case)
        # The next one is the first that is not in the interval, is after the end, or is one too many.
        following = source.start + len(times) / source.rate
        round_off = 1e-12 * max(1.0, following)
        assert len(times) == most or following >= min(stop, LONGEST) - round_off, case
    # A run that ends before has the first of these, up to its end and at it.
    for until in (0.25, 1.0, 1.5, *random.uniform(0.1, 2.5, 2), *times[-2:]):
        some = births_of(source, seed, float(until))
        n = 1 + int((times <= until).sum())
        assert some.births.there(float(until)) == n == whole.births.there(float(until)), (case, until)
        for what in ("position", "velocity", "mass"):
            rows = getattr(some, what)[..., :n], getattr(whole, what)[..., :n]
            assert np.array_equal(*rows), (case, until, what)
    if kind == "even" and source.stop is not None and source.stop > source.start:
        check_neighbours(source, times, seed, case)


def check_neighbours(source, times, seed, case):
    """Two sources, of which one begins where the other stops, have no birth at both ends and leave out none."""
    k = max(1, len(times) // 2)
    middle = source.start + k / source.rate
    ends = {name: getattr(source, name) for name in ("rate", "even", "speed", "temperature")}
    first = swarm.Source(0, start=source.start, stop=middle, **ends)
    second = swarm.Source(0, start=middle, stop=max(source.stop, middle), **ends)
    both = [births_of(one, seed, LONGEST) for one in (first, second)]
    found = [len(times_of(one)) for one in both]
    assert found[0] == k, case
    assert sum(found) == max(len(times), k), case


def check_frames(seed):
    """Three ends of a run, of which two are at frames of the third: what is in common frames is the same."""
    random = np.random.default_rng([11, seed])
    sources = [a_source(random, str(kind)) for kind in random.choice(KINDS, random.integers(1, 3))]
    start = swarm.fill(SCENE, 2, speed=1.0, seed=seed)
    every = float(random.choice([0.1, 0.25]))
    given = {"every": every, "compile": "never", "sources": sources, "seed": seed, "progress": False}
    given["observables"] = {"there": lambda frame: np.sort(frame.position[0])[:2]}
    ends = np.sort(random.choice(np.arange(1, 8), 3, replace=False)) * every
    runs = [swarm.simulate(SCENE, start, swarm.Impact(), until=float(until), **given).observables for until in ends]
    for short in runs[:2]:
        n = len(short["time"])
        for what, values in short.items():
            assert np.array_equal(values, runs[2][what][:n], equal_nan=True), (f"seed {seed}: {sources}, {ends}", what)


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_births_are_in_their_intervals(kind):
    for seed in range(kind, 6 * len(KINDS), len(KINDS)):
        check_births(seed)


@pytest.mark.parametrize("seed", range(3))
def test_frames_do_not_depend_on_the_end_of_the_run(seed):
    check_frames(seed)


@pytest.mark.long
def test_many_births_are_in_their_intervals():
    for seed in range(1000):
        check_births(seed)


@pytest.mark.long
def test_many_frames_do_not_depend_on_the_end_of_the_run():
    for seed in range(60):
        check_frames(seed)
