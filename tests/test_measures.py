"""User-defined observables, and the particles of frames that users are given."""

import numpy as np
import pytest
from test_sessions import stopped_at

import swarm
from swarm.common.catalog import OBSERVABLES
from swarm.run import machine

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
DOWN = (0.0, 0.0, -1.0)
START = swarm.fill(SPHERE, 300, speed=1.0, mass=np.linspace(0.5, 2.0, 300), seed=1)
QUICK = {"until": 2.0, "every": 0.5, "compile": "never"}


def kinetic(frame):
    return 0.5 * (frame.mass * (frame.velocity**2).sum(axis=0)).sum()


def spectrum(frame):
    return np.histogram(frame.position[2], 4, (-0.5, 0.5))[0]


def energy(frame):
    return frame.energy.sum()


OWN = {"kinetic": kinetic, "spectrum": spectrum, "energy": energy}


def run(functions=None, **keywords):
    return swarm.simulate(SPHERE, START, swarm.Impact(), **{**QUICK, "observables": functions, **keywords})


def bodies(scene):
    return swarm.place(scene, swarm.dumbbell(0.1, 1.0), 5, speed=1.0, spin=1.0, seed=1)


BALL = swarm.Sphere(0.3, side="outside")
HOLE = swarm.Sphere(0.2, (0.0, 0.0, 0.5))
KINDS = {
    "impact": (swarm.Scene([swarm.Sphere(0.5)], DOWN), swarm.Impact()),
    "penalty": (SPHERE, swarm.Penalty(dt=0.125, penalty=1e3)),
    "loops": (SPHERE, swarm.AugmentedLagrangian(dt=0.125, penalty=1e3, adaptive=True)),
    "a cell": (swarm.Scene([BALL], DOWN, period=(1.0, 1.0, 1.0)), swarm.Impact()),
    "openings": (swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])]), swarm.Impact()),
    "doors": (swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Opening(HOLE, times=[(0.3, 0.7)])])]), swarm.Impact()),
    "walls that react": (swarm.Scene([swarm.Sphere(0.5, mass=5.0)]), swarm.Impact()),
    "walls that move": (
        swarm.Scene([swarm.Sphere(0.5, motion=swarm.Oscillation((0.1, 0.0, 0.0), 1.0))]),
        swarm.Impact(),
    ),
    "bodies": (swarm.Scene([swarm.Box((0.5, 0.5, 0.5))], DOWN), swarm.Impact(dt=0.05)),
}


@pytest.mark.parametrize("name", KINDS)
def test_they_are_what_the_engines_own_are_and_stand_beside_them(name, tmp_path):
    """The sums that every run has too, of every kind of run; without them nothing else changes."""
    scene, method = KINDS[name]
    start = bodies(scene) if name == "bodies" else swarm.fill(scene, 40, speed=1.0, seed=2)
    one = swarm.simulate(scene, start, method, observables=OWN, trajectory=tmp_path / "run.h5", **QUICK)
    seen, other = one.observables, swarm.simulate(scene, start, method, **QUICK).observables
    for key, values in other.items():
        assert values.tobytes() == seen[key].tobytes(), key
        lengths = {"surface": len(scene.surfaces), "part": len(scene.parts)}
        shape = OBSERVABLES[key].shape(lengths)
        assert [known in (got, None) for got, known in zip(values.shape[1:], shape, strict=True)] == [True] * len(shape)
    assert set(seen) == set(other) | set(OWN)
    assert seen["kinetic"] == pytest.approx(seen["kinetic_energy"], rel=1e-13)
    assert seen["energy"] == pytest.approx(seen["kinetic_energy"] + seen["potential_energy"], rel=1e-12)
    assert (seen["spectrum"].shape, seen["spectrum"].dtype) == ((5, 4), np.float64)
    with swarm.load(tmp_path / "run.h5") as written:
        assert written.own_observables == list(OWN)
        for key, values in seen.items():
            assert values.tobytes() == written.observables[key].tobytes(), key
    for frame, mine in zip(one.frames, seen["spectrum"], strict=True):
        assert spectrum(frame).tolist() == mine.tolist()
        assert frame.impacts.sum() == frame.observables["impacts"] * (2 if name == "bodies" else 1)
        assert kinetic(frame) == pytest.approx(frame.observables["kinetic_energy"], rel=1e-13)


@pytest.mark.level3
@pytest.mark.parametrize("keywords", [{"threads": 2}, {"threads": 3, "block_size": 1}, {"compile": "always"}], ids=str)
def test_they_have_the_same_bits_however_a_run_is_carried_out(keywords):
    one, other = run(OWN, threads=1).observables, run(OWN, **keywords).observables
    assert all(one[name].tobytes() == other[name].tobytes() for name in OWN)


def test_a_run_that_is_resumed_has_all_frames_of_them(tmp_path):
    path = tmp_path / "run.h5"
    more = {"compile": "never", "observables": OWN}
    stopped_at(path, 2, **more)
    start = swarm.fill(SPHERE, 20, speed=1.0, seed=1)

    def ended(**keywords):
        return swarm.simulate(SPHERE, start, swarm.Impact(), until=2.0, every=0.5, **more | keywords)

    with pytest.raises(swarm.SceneError, match="its user-defined observables are kinetic, spectrum, energy, got kin"):
        ended(trajectory=path, resume=True, observables={"kinetic": kinetic})
    other = OWN | {"spectrum": lambda frame: frame.position[0]}
    with pytest.raises(
        swarm.RunError, match=r"same shape .* \(4,\) as at those before, got \(20,\), at frame 3, 1.5 s"
    ):
        ended(trajectory=path, resume=True, observables=other)
    one, whole = ended(trajectory=path, resume=True).observables, ended().observables
    for name, values in whole.items():
        assert values.tobytes() == one[name].tobytes(), name


BAD = {
    "raises": (lambda frame: 1 / 0, r"failed at frame 0, 0 s: ZeroDivisionError: division by zero \(.*, line \d+\)"),
    "no frame": (lambda: 1.0, "failed at frame 0, 0 s: TypeError"),
    "no attribute": (lambda frame: frame.speed, "AttributeError: 'Frame' object has no attribute 'speed'"),
    "writes": (lambda frame: frame.velocity.fill(0.0), "ValueError: assignment destination is read-only"),
    "others": (lambda frame: frame.observables["impulse"], "take it from result.observables"),
    "none": (lambda frame: None, "must return a number or an array of numbers, got None, at frame 0"),
    "a text": (lambda frame: "hot", "an array of numbers, got 'hot'"),
    "complex": (lambda frame: 1j, "an array of numbers, got 1j"),
    "complex array": (lambda frame: frame.mass * 1j, "an array of numbers, got an array of complex128"),
    "ragged": (lambda frame: [1, [2]], r"got \[1, \[2\]\]"),
    "empty": (lambda frame: [], r"got \[\]"),
    "masked": (lambda frame: np.ma.array([1.0], mask=[True]), "got a masked array; fill it"),
    "axes": (lambda frame: np.zeros((1, 1, 1, 1)), r"with at most 3 axes, got the shape \(1, 1, 1, 1\)"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_function_that_fails_is_named_before_anything_is_made(name, tmp_path, monkeypatch):
    """No kernel, and no file."""
    function, sentence = BAD[name]
    monkeypatch.setattr(machine, "run_of", lambda *given: pytest.fail("it has begun"))
    with pytest.raises(swarm.SceneError, match=r"^observables\['mine'\] .*" + sentence):
        run({"kinetic": kinetic, "mine": function}, trajectory=tmp_path / "run.h5")
    assert not (tmp_path / "run.h5").exists()


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ([kinetic], "must be a dict of functions of a frame by their names"),
        ({"mean radius": kinetic}, "must have names such as mean_radius, got 'mean radius'"),
        ({7: kinetic}, "must have names such as mean_radius, got 7"),
        ({"kinetic": 7.0}, r"observables\['kinetic'\] must be a function of a frame, got 7.0"),
        ({"impacts": kinetic}, r"observables\['impacts'\] must have another name"),
        ({"time": kinetic}, "must have another name"),
        ({"momentum_x": kinetic}, "must have another name"),
        ({"mine": spectrum, "mine_0": kinetic}, r"observables\['mine_0'\] must have another name"),
    ],
)
def test_names_and_what_is_no_function_are_refused(given, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        run(given)


def test_a_function_that_fails_later_ends_the_run_and_leaves_the_frames_before(tmp_path):
    def late(frame):
        return 1.0 / (1.0 - frame.time)

    with pytest.raises(swarm.RunError, match=r"\['late'\] failed at frame 2, 1 s: ZeroDivisionError"):
        run({"late": late}, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as written:
        assert written.observables["late"].tolist() == [1.0, 2.0]


def test_not_a_number_stands_for_no_measure_also_in_the_file(tmp_path):
    def of_the_slow(frame):
        return np.array([np.nan, np.inf, frame.time])

    result = run({"slow": of_the_slow, "none": lambda frame: np.nan}, trajectory=tmp_path / "run.h5")
    assert np.isnan(result.observables["none"]).all()
    with swarm.load(tmp_path / "run.h5") as written:
        assert np.array_equal(written.observables["slow"], result.observables["slow"], equal_nan=True)
        assert written.table()[["slow_1", "slow_2"]].to_numpy()[-1].tolist() == [np.inf, 2.0]
        assert written.to_xarray()["slow"].dims == ("time", "slow_0")
        assert "slow" in written._repr_html_()
        assert written.plot(figsize=(10.0, 6.0)).axes
    assert result.table()["none"].isna().all()


def test_what_they_take_is_counted_before_the_run():
    with pytest.raises(swarm.SceneError, match="every must leave frames that fit"):
        run({"all": lambda frame: np.zeros(10**7)}, until=1e5)


def test_numbers_of_births_and_of_absorbed_particles():
    """A frame has the particles that are there: those not yet born have no place in it, absorbed ones have a time."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Absorb(0.5)])])
    own = {
        "there": lambda frame: frame.position.shape[1],
        "gone": lambda frame: np.isfinite(frame.absorbed_time).sum(),
        "inside": lambda frame: np.isfinite(frame.velocity).all(),
    }
    seen = swarm.simulate(
        scene, START, swarm.Impact(), observables=own, sources=[swarm.Source(0, rate=30.0, speed=1.0)], **QUICK
    ).observables
    assert seen["there"].tolist() == (300 + seen["born"][:, 0]).tolist()
    assert seen["gone"].tolist() == seen["absorbed"][:, 0].tolist()
    assert 0 < seen["gone"][-1] < seen["there"][-1]
    assert seen["born"][-1, 0] > 30
    assert seen["inside"].all()


# --- Frames ----------------------------------------------------------------------------------------------


def test_a_function_may_keep_arrays_of_a_frame_and_reads_no_other_ones_later():
    """They are copies; what it has not read is not that of a later frame."""
    kept = []

    def keeps(frame):
        kept.append((frame, frame.position))
        return 1.0

    result = run({"kept": keeps}, compile="never")
    assert kept[0][1].tobytes() == START.position.tobytes()
    assert kept[-1][1].tobytes() == result.particles.position.tobytes()
    with pytest.raises(swarm.SceneError, match=r"^frame 0 is over, and frame.velocity was not read before"):
        _ = kept[0][0].velocity


def test_progress_has_the_particles_as_copies_that_stay():
    seen, spots, times = [], [], []

    def progress(frame):
        seen.append(frame)
        spots.append(frame.position)
        times.append(frame.energy.sum())
        with pytest.raises(ValueError, match="read-only"):
            frame.position[0, 0] = 1.0

    result = run(None, progress=progress)
    assert spots[-1].tobytes() == result.particles.position.tobytes()
    assert spots[0].tobytes() == START.position.tobytes()
    assert times == pytest.approx(result.observables["kinetic_energy"], rel=1e-13)
    assert seen[1].position is spots[1]
    with pytest.raises(swarm.SceneError, match=r"^frame 1 is over, .* frame.impacts .* \(result.frames\)$"):
        _ = seen[1].impacts


def test_frames_of_a_result_are_a_sequence(tmp_path):
    result = run(OWN, trajectory=tmp_path / "run.h5", frames=7)
    frames = result.frames
    assert (len(frames), len(list(frames)), len(frames[1:3])) == (5, 5, 2)
    assert [frame.time for frame in frames] == result.observables["time"].tolist()
    assert [frame.number for frame in frames[::-2]] == [4, 2, 0]
    last = frames[-1]
    assert last.position.tobytes() == result.particles.position[:, ::7].tobytes()
    assert last.impacts.tolist() == result.impacts_per_particle[::7].tolist()
    assert (last.until, last.image, np.isnan(last.escape_time).all()) == (2.0, None, True)
    assert last.observables["spectrum"].tolist() == result.observables["spectrum"][-1].tolist()
    for wrong, error in ((5, IndexError), ("a", swarm.SceneError), (1.0, swarm.SceneError)):
        with pytest.raises(error):
            _ = frames[wrong]
    bare = run(None, trajectory=tmp_path / "bare.h5", frames="none").frames
    with pytest.raises(swarm.SceneError, match='run with frames = "none"'):
        _ = bare[0].position
    with pytest.raises(swarm.SceneError, match="frames are those of the trajectory, and this run has written none"):
        _ = run().frames
