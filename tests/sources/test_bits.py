"""Runs with sources have the same bits for any threads, blocks, halts, sessions, shards and tiers."""

import dataclasses
import functools

import numpy as np
import pytest
from cut_short import halted, in_sessions
from same_bits import require_same

import swarm
from swarm.run.engine import Run
from swarm.run.session import Session

BOX = swarm.Box((0.5, 0.5, 0.5))
TIMES = {"until": 1.0, "every": 0.125, "seed": 4}
MOUTH = swarm.Box((0.1, 0.1, 0.05), center=(0.0, 0.0, 0.3))
SHUTTER = swarm.Plane((0.0, 0.3, 1.0), 0.4, present=[(0.0, 0.3), (0.6, np.inf)])
TETRAHEDRON = swarm.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
TUBE = dataclasses.replace(BOX, openings=[swarm.Opening(swarm.Sphere(0.2, (0.5, 0, 0)), [(0.2, 0.7)])])
# Particles of the start and of the sources are in two chunks of 256, so they are two blocks.
CASES = {
    "a wall": ([swarm.Cylinder(0.5, length=1.0)], {}, swarm.Source(0, rate=150.0, temperature=1.0)),
    "a hot wall": ([swarm.Sphere(0.5, temperature=2.0)], {}, swarm.Source(0, rate=150.0, temperature=1.0)),
    "grains": (
        [swarm.Box((0.2, 0.2, 0.4), restitution=0.3, friction=0.4)], {"gravity": (0.0, 0.0, -9.81)},
        swarm.Source(MOUTH, volume=True, rate=300.0, speed=0.1),
    ),
    "a valve": ([TUBE], {}, swarm.Source(TUBE.openings[0], rate=150.0, temperature=1.0)),
    "a shutter": (
        [BOX, SHUTTER], {}, swarm.Source(0, rate=400.0, speed=1.0, within=swarm.Box((1, 1, 0.1), (0, 0, -0.4))),
    ),
    "a piston": (
        [BOX, swarm.Plane((0, 0, 1), 0.3, motion=swarm.Oscillation((0, 0, 0.1), 1.0), restitution=0.9)], {},
        swarm.Source(0, rate=300.0, beam=(0.1, 0.2, 1.0), within=swarm.Box((0.4, 0.4, 0.01), (0, 0, -0.5))),
    ),
    "a union": (
        [swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.2, length=2.0)])], {}, swarm.Source(0, rate=150.0, speed=1.0),
    ),
    "a mesh": ([TETRAHEDRON], {}, swarm.Source(0, rate=150.0, speed=1.0)),
    "a cell": (
        [swarm.Sphere(0.3, (0.5, 0.5, 0.5), side="outside")], {"period": (1, 1, 1)},
        swarm.Source(0, rate=150.0, speed=1.0),
    ),
    "a plane": ([swarm.Stadium(0.4, 0.4)], {"plane": "z"}, swarm.Source(0, rate=150.0, temperature=1.0)),
    "many balls": (
        [BOX, swarm.Spheres(np.mgrid[-1:2, -1:2, -1:2].reshape(3, -1).T * 0.3, 0.08)], {},
        [swarm.Source(1, rate=75.0, speed=1.0), swarm.Source(0, rate=75.0, temperature=1.0)],
    ),
}  # fmt: skip
# Each observation of these takes a tenth of a second in plain Python, so they have few.
MANY_WALLS = ("a mesh", "a plane", "many balls")
# Compiled too, in the plain ring.
COMPILED = ("a wall", "grains")


@functools.cache
def job(name):
    surfaces, more, source = CASES[name]
    scene = swarm.Scene(surfaces, **more)
    # Those of the start end within a chunk.
    start = None if name in ("grains", "a piston", "a shutter") else swarm.fill(scene, 160, speed=0.6, seed=2)
    return scene, start, source


def run(name, **more):
    scene, start, source = job(name)
    return swarm.simulate(scene, start, swarm.Impact(), sources=source, **{**TIMES, "threads": 1, **more})


@pytest.mark.parametrize("name", CASES)
def test_threads_blocks_and_halts(name, monkeypatch):
    """In plain Python; halted in every frame after each few passes."""
    plain = {"compile": "never", "every": 0.25 if name in MANY_WALLS else 0.125}
    one = run(name, **plain)
    assert one.observables["born"][-1].sum() > 100
    assert one.particles.position.shape[1] > 256
    assert one.observables["energy_error"].max() < 1e-12
    require_same(one, run(name, threads=2, block_size=256, **plain))
    with halted(monkeypatch, Run, 1) as calls:
        require_same(one, run(name, **plain))
    assert len(calls) > 10


@pytest.mark.parametrize("name", COMPILED)
def test_compiled_and_in_plain_python(name):
    one = run(name, compile="never")
    for threads in (1, 2):
        require_same(one, run(name, compile="always", threads=threads))


@pytest.mark.parametrize("name", COMPILED)
def test_resumed_at_any_place(name, tmp_path, monkeypatch):
    """Each session ends within a frame, or at one, and the next one begins with its checkpoint."""
    whole = run(name, compile="never", trajectory=tmp_path / "whole.h5")
    parts, sessions = in_sessions(
        monkeypatch,
        Run,
        2,
        lambda: run(name, compile="never", trajectory=tmp_path / "parts.h5", resume=True, checkpoint=1e3),
    )
    assert sessions > 12
    require_same(whole, parts)
    with swarm.load(tmp_path / "whole.h5") as one, swarm.load(tmp_path / "parts.h5") as other:
        for k in range(len(one)):
            np.testing.assert_array_equal(one.frame(k).position, other.frame(k).position)


def test_another_seed_or_another_source_is_another_run(tmp_path):
    """Found by the digest of the start."""
    with pytest.MonkeyPatch.context() as patch:
        look = Session.look

        def stops(self, *given):
            self.stop()
            return look(self, *given)

        patch.setattr(Session, "look", stops)
        with pytest.raises(KeyboardInterrupt):
            run("a wall", compile="never", trajectory=tmp_path / "run.h5", checkpoint=1e3)
    scene, start, source = job("a wall")
    for changed in ({"rate": 500.0}, {"mass": 2.0}, {"start": 0.1}):
        other = dataclasses.replace(source, **changed)
        with pytest.raises(swarm.SceneError, match="is of another run"):
            swarm.simulate(
                scene, start, swarm.Impact(), sources=other, resume=True, trajectory=tmp_path / "run.h5", **TIMES
            )


def test_a_scene_without_sources_has_the_same_bits():
    """Also with a source that gives nothing."""
    scene, start, _source = job("a wall")
    none, late = (
        swarm.simulate(scene, start, swarm.Impact(), sources=given, compile="never", **TIMES)
        for given in (None, [swarm.Source(0, times=[5.0], speed=1.0)])
    )
    assert "born" not in none.observables
    shared = {name: late.observables[name] for name in none.observables}
    require_same(none, dataclasses.replace(late, observables=shared))
    assert none.birth_time.max() == late.birth_time.max() == 0.0
