"""Files of samples, and of particles, that say more than they hold: one sentence, and nothing of that size is made."""

import io
import tracemalloc

import h5py
import numpy as np
import pytest

import swarm
from swarm.surfaces.data.arrays import read_samples

AXIS = np.linspace(-1.0, 1.0, 8)
VALUES = AXIS[:, None, None] ** 2 + AXIS[:, None] ** 2 + AXIS**2 - 0.64


def saved(array, **options):
    file = io.BytesIO()
    np.save(file, array, **options)
    return file.getvalue()


def saying(header):
    """The samples behind another header, of version 1.0."""
    text = header.encode("latin1")
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + VALUES.tobytes()


def described(shape, kind="'<f8'"):
    return saying(f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}\n")


def archive():
    file = io.BytesIO()
    np.savez(file, a=VALUES, b=VALUES)
    return file.getvalue()


LYING = {
    "petabytes": described("(100000, 100000, 100000)"),
    "more than an index": described(f"({2**62}, {2**62}, 4)"),
    "more than a number": described(f"({10**40}, 8, 8)"),
    "no end": described("(8, 8, 9)"),
    "negative": described("(-8, -8, 8)"),
    "a half": described("(0.5, 8, 8)"),
    "a word": described("'eight'"),
    "objects": described("(8, 8, 8)", "'|O'"),
    "records": described("(8, 8, 8)", "[('x', '<f4'), ('y', '<f4')]"),
    "texts": described("(8, 8, 8)", "'<U2'"),
    "complex": described("(8, 8, 4)", "'<c16'"),
    "truths": described("(8, 8, 64)", "'|b1'"),
    "no kind": described("(8, 8, 8)", "'none'"),
    "no dictionary": saying("[1, 2, 3]\n"),
    "no Python": saying("{'descr': ((((\n"),
    "code": saying("__import__('os').getcwd()\n"),
    "nested": saying("(" * 3000 + "\n"),
    "another version": b"\x93NUMPY\x09\x00" + saved(VALUES)[8:],
    "a long header": b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + saved(VALUES)[10:],
    "half": saved(VALUES)[:1500],
    "header alone": saved(VALUES)[:40],
    "nothing": b"",
    "an archive": archive(),
    "pickled": saved(np.array([None, 1], dtype=object), allow_pickle=True),
    "text": b"x,y,z\n1,2,3\n",
}


@pytest.mark.parametrize("name", LYING)
def test_a_numpy_file_that_lies(name, tmp_path):
    path = tmp_path / "phi.npy"
    path.write_bytes(LYING[name])
    tracemalloc.start()
    try:
        with pytest.raises(swarm.SceneError, match=r"phi\.npy") as caught:
            read_samples(path)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("seed", range(20))
def test_any_damage_of_a_header_is_one_sentence(seed, tmp_path):
    random, path, whole = np.random.default_rng(seed), tmp_path / "phi.npy", saved(VALUES)
    for _trial in range(20):
        damaged = bytearray(whole)
        for place in random.integers(0, 128, random.integers(1, 4)):
            damaged[place] = random.integers(0, 256)
        path.write_bytes(damaged)
        message = ""
        try:
            assert read_samples(path).nbytes <= VALUES.nbytes
        except swarm.SceneError as error:
            message = str(error)
        assert "\n" not in message


SHAPES = {
    "petabytes": {"shape": (10**5, 10**5, 10**5), "chunks": (10, 10, 10)},
    "more than the file": {"shape": (200, 200, 200)},
    "packed": {"shape": (2000, 2000, 200), "chunks": (10, 10, 10), "compression": "gzip"},
    "packed petabytes": {"shape": (10**5, 10**5, 10**5), "chunks": (10, 10, 10), "compression": "gzip"},
    "texts": {"shape": (4, 4, 4), "dtype": "S8"},
    "records": {"shape": (4, 4, 4), "dtype": [("x", float)]},
}


@pytest.mark.parametrize("name", SHAPES)
def test_an_hdf5_file_that_lies(name, tmp_path):
    with h5py.File(tmp_path / "phi.h5", "w") as file:
        file.create_dataset("phi", **({"dtype": float} | SHAPES[name]))
    with pytest.raises(swarm.SceneError, match=r"phi\.h5 must (hold|fit)") as caught:
        read_samples(tmp_path / "phi.h5")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.6, 0.95])
def test_a_truncated_hdf5_file(share, tmp_path):
    path = tmp_path / "phi.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("phi", data=VALUES, compression="gzip")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(swarm.SceneError, match=r"cannot read the samples in .*phi\.h5"):
        read_samples(path)


def test_what_is_whole_is_read(tmp_path):
    np.save(tmp_path / "phi.npy", np.asfortranarray(VALUES))
    with h5py.File(tmp_path / "phi.h5", "w") as file:
        file.create_dataset("phi", data=VALUES, compression="gzip", chunks=(4, 4, 4))
        file["constant"] = 1.0
    for name in ("phi.npy", "phi.h5"):
        assert (read_samples(tmp_path / name) == VALUES).all()
    # Samples that are the same everywhere pack well, but not a thousand times.
    with h5py.File(tmp_path / "same.h5", "w") as file:
        file.create_dataset("phi", data=np.ones((100, 100, 100)), compression="gzip", compression_opts=9)
    assert read_samples(tmp_path / "same.h5").shape == (100, 100, 100)


LONG = ["particles/all/mass", "particles/all/id", "particles/all/position/value", "particles/all/velocity/value"]


@pytest.mark.parametrize("names", [LONG, LONG[:1], ["parameters/time"]], ids=["all", "mass", "time"])
def test_a_trajectory_that_lies(names, tmp_path):
    """It says that it holds a million million particles, or frames, in all places that say so or in one."""
    scene, path = swarm.Scene([swarm.Sphere(1.0)]), tmp_path / "start.h5"
    swarm.simulate(scene, swarm.fill(scene, 5, speed=1.0), swarm.Impact(), until=0.1, trajectory=path, compile="never")
    with h5py.File(path, "r+") as file:
        file["parameters/particles"][()] = 10**12
        for name in names:
            shape, kind = list(file[name].shape), file[name].dtype
            shape[len(shape) // 2] = 10**12
            del file[name]
            file.create_dataset(name, shape, kind, chunks=(1, 1000, 3)[: len(shape)])
    with pytest.raises(swarm.SceneError, match=r"start\.h5"), swarm.load(path) as trajectory:
        trajectory.frame(-1)


CSV = {
    "NUL": b"x,y,z,vx,vy,vz\n0,0,0,1,0,\x00\n",
    "not UTF-8": b"x,y,z,vx,vy,vz\n\xff\xfe,0,0,1,0,0\n",
    "a long cell": b"x,y,z,vx,vy,vz\n" + b"1" * 200_000 + b",0,0,1,0,0\n",
    "a long number": b"x,y,z,vx,vy,vz\n" + b"1" * 5_000 + b",0,0,1,0,0\n",
    "an open quote": b'x,y,z,vx,vy,vz\n"0,0,0,1,0,0\n',
    "no header": b"0,0,0,1,0,0\n",
    "nothing": b"",
    "no rows": b"x,y,z,vx,vy,vz\n\n\n",
    "ragged": b"x,y,z,vx,vy,vz\n0,0,0,1,0,0\n0,0,0,1\n",
    "infinite": b"x,y,z,vx,vy,vz\n0,0,0,1,0,1e999\n",
    "huge": b"x,y,z,vx,vy,vz\n0,0,0,1,0,1e200\n",
    "a formula": b"x,y,z,vx,vy,vz\n=1+1,0,0,1,0,0\n",
}


@pytest.mark.parametrize("name", CSV)
def test_a_csv_file_that_lies(name, tmp_path):
    path = tmp_path / "start.csv"
    path.write_bytes(CSV[name])
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Particles.from_csv(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500
