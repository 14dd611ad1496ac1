"""Particles: what they hold, what they refuse, and CSV files."""

import math

import numpy as np
import pytest

import swarm

GOOD = np.arange(6.0).reshape(3, 2)


def test_arrays_are_copied_in_c_order():
    position = np.asfortranarray(GOOD)
    particles = swarm.Particles(position, GOOD, mass=[1.0, 2.0])
    assert particles.position.flags.c_contiguous
    assert particles.velocity.flags.c_contiguous
    particles.position[0, 0] = particles.velocity[0, 0] = particles.mass[0] = 99.0
    assert position[0, 0] == GOOD[0, 0] == 0.0
    assert len(particles) == 2


@pytest.mark.parametrize("mass", [3, 3.0, [3.0, 3.0], np.float32(3.0)])
def test_one_mass_is_for_all(mass):
    particles = swarm.Particles(GOOD, GOOD, mass)
    assert (particles.mass == [3.0, 3.0]).all()
    particles.mass[0] = 1.0
    assert particles.mass[1] == 3.0


def test_one_particle_as_three_numbers():
    particles = swarm.Particles((1, 2, 3), (3.0, 0.0, 4.0))
    assert particles.position.shape == (3, 1)
    assert particles.fastest() == 5.0


def changed(value, mass=1.0):
    position = GOOD.copy()
    position[1, 1] = value
    return lambda: swarm.Particles(position, GOOD, mass)


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Particles(np.zeros((3, 0)), np.zeros((3, 0))), ["position", "at least one particle", "(3, 0)"]),
        (lambda: swarm.Particles(np.zeros((4, 3)), GOOD), ["position", "(3, N)", "(4, 3)", "transpose"]),
        (lambda: swarm.Particles(GOOD, np.zeros((2, 3))), ["velocity", "(3, N)", "(2, 3)", "transpose"]),
        (lambda: swarm.Particles(np.zeros((2, 2)), GOOD), ["position", "(3, N)", "(2, 2)"]),
        (lambda: swarm.Particles(np.zeros((3, 2, 2)), GOOD), ["position", "(3, N)", "(3, 2, 2)"]),
        (lambda: swarm.Particles(1.0, GOOD), ["position", "(3, N)", "()"]),
        (lambda: swarm.Particles(GOOD, np.zeros((3, 3))), ["velocity", "shape of position, (3, 2)", "(3, 3)"]),
        (lambda: swarm.Particles([["a"], ["b"], ["c"]], GOOD), ["position", "array of numbers"]),
        (lambda: swarm.Particles([[1.0], [1.0, 2.0], [3.0]], GOOD), ["position", "array of numbers"]),
        (changed(math.nan), ["position", "finite", "nan", "particle 1", "1 such"]),
        (changed(-math.inf), ["position", "finite", "-inf", "particle 1"]),
        (lambda: swarm.Particles(GOOD, GOOD * math.nan), ["velocity", "particle 0", "2 such"]),
        (changed(1e300), ["position", "at most 1e+100", "1e+300", "particle 1"]),
        (lambda: swarm.Particles(GOOD * 1j, GOOD), ["position", "array of numbers", "complex128"]),
        (lambda: swarm.Particles(GOOD, np.ma.array(GOOD, mask=GOOD > 3.0)), ["velocity", "without a mask"]),
        (lambda: swarm.Particles([np.ma.array(row, mask=row > 3.0) for row in GOOD], GOOD), ["position", "mask"]),
        (lambda: swarm.Particles(GOOD, GOOD, 1j), ["mass", "array of numbers", "complex"]),
        (lambda: swarm.Particles(GOOD, GOOD, 1e-200), ["mass", "1e-100", "particle 0"]),
        (lambda: swarm.Particles(GOOD, GOOD, 0.0), ["mass", "above 0", "got 0", "particle 0"]),
        (lambda: swarm.Particles(GOOD, GOOD, [1.0, -2.0]), ["mass", "above 0", "got -2", "particle 1"]),
        (lambda: swarm.Particles(GOOD, GOOD, [1.0, math.nan]), ["mass", "finite", "nan", "particle 1"]),
        (lambda: swarm.Particles(GOOD, GOOD, [1.0, 2.0, 3.0]), ["mass", "shape (2,)", "(3,)"]),
        (lambda: swarm.Particles(GOOD, GOOD, np.ones((2, 1))), ["mass", "shape (2,)", "(2, 1)"]),
        (lambda: swarm.Particles(GOOD, GOOD, "heavy"), ["mass", "number"]),
        (lambda: swarm.Particles(GOOD, GOOD, radius=0.0), ["radius must be", "above 0", "particle 0"]),
        (lambda: swarm.Particles(GOOD, GOOD, spin=GOOD), ["spin must be None without a radius"]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


# --- CSV -------------------------------------------------------------------------------------------------


@pytest.fixture
def table(tmp_path):
    """Write a CSV file and read it as particles."""

    def read(text, **options):
        path = tmp_path / "start.csv"
        path.write_text(text, **({"encoding": "utf-8"} | options))
        return swarm.Particles.from_csv(path)

    return read


def test_columns_may_have_any_order(table):
    particles = table(" vx,vy,vz,mass, x,y,z\n4,5,6,7,1,2,3\n\n.4,.5,.6,.7,.1,.2,1e-3\n")
    assert (particles.position == [[1.0, 0.1], [2.0, 0.2], [3.0, 1e-3]]).all()
    assert (particles.velocity == [[4.0, 0.4], [5.0, 0.5], [6.0, 0.6]]).all()
    assert (particles.mass == [7.0, 0.7]).all()


def test_mass_is_one_where_there_is_no_column(table):
    assert (table("x,y,z,vx,vy,vz\n1,2,3,4,5,6\n").mass == [1.0]).all()


def test_balls_have_a_radius_and_may_have_a_spin(table):
    balls = table("radius,x,y,z,vx,vy,vz\n0.5,1,2,3,4,5,6\n0.2,1,2,3,4,5,6\n")
    assert (balls.radius == [0.5, 0.2]).all()
    assert balls.spin is None
    turning = table("x,y,z,vx,vy,vz,radius,wz,wx,wy\n1,2,3,4,5,6,0.5,9,7,8\n")
    assert (turning.spin == [[7.0], [8.0], [9.0]]).all()


@pytest.mark.parametrize("options", [{"encoding": "utf-8-sig"}, {"newline": "\r\n"}], ids=repr)
def test_files_from_spreadsheets(table, options):
    assert len(table("x,y,z,vx,vy,vz\n1,2,3,4,5,6\n", **options)) == 1


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["x, y, z, vx, vy, vz", "'x' is missing"]),
        ("x,y,z,vx,vy\n1,2,3,4,5\n", ["'vz' is missing"]),
        ("x,y,z,vx,vy,vz,charge\n1,2,3,4,5,6,7\n", ["charge", "optionally mass"]),
        ("x,y,z,vx,vy,vz,x\n1,2,3,4,5,6,7\n", ["columns are x, y, z, vx, vy, vz, x"]),
        ("x,y,z,vx,vy,vz\n", ["at least one particle", "none"]),
        ("x,y,z,vx,vy,vz\n1,2,3,4,5,6\n1,2,3,4,fast,6\n", ["row 3", "column 'vy'", "finite number", "'fast'"]),
        ("x,y,z,vx,vy,vz\n1,2,,4,5,6\n", ["row 2", "column 'z'", "''"]),
        ("x,y,z,vx,vy,vz\n1_0,2,3,4,5,6\n", ["row 2", "column 'x'", "finite number", "'1_0'"]),
        ("x,y,z,vx,vy,vz\n1,2,3,4,5,\u0663\n", ["row 2", "column 'vz'", "finite number", "\u0663"]),
        ("x,y,z,vx,vy,vz\n1,2,3,4,5,inf\n", ["row 2", "column 'vz'", "'inf'"]),
        ("x,y,z,vx,vy,vz\n1,2,3,4,5,6\n\n1,2,3\n", ["row 4", "6 cells", "got 3"]),
        ("x,y,z,vx,vy,vz,mass\n1,2,3,4,5,6,-1\n", ["row 2", "column 'mass'", "above 0", "'-1'"]),
        ("x,y,z,vx,vy,vz,radius\n1,2,3,4,5,6,0\n", ["row 2", "column 'radius'", "above 0", "'0'"]),
        ("x,y,z,vx,vy,vz,radius,wx\n1,2,3,4,5,6,1,1\n", ["wx, wy, wz of spins all together and with radius"]),
        ("x,y,z,vx,vy,vz,wx,wy,wz\n1,2,3,4,5,6,1,1,1\n", ["wx, wy, wz of spins all together and with radius"]),
        ("x,y,z,vx,vy,vz\n1,2,3,4,5," + 200_000 * "6" + "\n", ["cannot read", "field larger than field limit"]),
    ],
)
def test_errors_name_file_row_and_column(table, text, parts):
    with pytest.raises(swarm.SceneError) as caught:
        table(text)
    assert all(part in str(caught.value) for part in ["start.csv", *parts]), str(caught.value)


HEAD, ROW = "x,y,z,vx,vy,vz\n", "1,2,3,4,5,6\n"


@pytest.mark.parametrize(
    "text",
    [
        "\n\n" + HEAD + ROW, HEAD + "   \n" + ROW, '"x", "y", "z", "vx", "vy", "vz"\n' + ROW,
        (HEAD + ROW).replace("\n", "\r"),
    ],
    ids=["blank lines above", "a line of blanks", "blanks before quotes", "lines of old Macs"],
)  # fmt: skip
def test_what_editors_and_other_programs_do(table, text):
    assert table(text).velocity[:, 0].tolist() == [4.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("x;y;z;vx;vy;vz\n0,1;0;0;1,5;0;0\n", "'x;y;z;vx;vy;vz'; write commas between columns, and points in numbers"),
        ("x\ty\tz\tvx\tvy\tvz\n", "write commas between columns"),
        ("x y z vx vy vz\n", "write commas between columns"),
        (ROW, "'1,2,3,4,5,6'; write the names of the columns above the numbers"),
        ("X,Y,Z,VX,VY,VZ\n" + ROW, "'X,Y,Z,VX,VY,VZ'; write the names as they are here"),
        ("x [m],y [m],z [m],vx,vy,vz\n" + ROW, "without units"),
        ("# made by hand\n" + HEAD + ROW, "'# made by hand'; write the names as they are here"),
        ("\n\n", "the file is empty"),
    ],
)
def test_a_wrong_header_is_refused_with_its_mend(table, text, hint):
    with pytest.raises(swarm.SceneError, match=r"start\.csv: expected the columns x, y, z") as caught:
        table(text)
    assert hint in str(caught.value)


def test_bytes_of_another_code_are_named_with_their_row(tmp_path):
    (tmp_path / "start.csv").write_bytes((HEAD + 3 * ROW).encode() + "1,2,3,4,5,6é\n".encode("latin-1"))
    with pytest.raises(swarm.SceneError, match=r"start\.csv, row 5: expected text in UTF-8, got the byte 0xe9"):
        swarm.Particles.from_csv(tmp_path / "start.csv")


def test_a_file_that_cannot_be_read(tmp_path):
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "none.csv", tmp_path, tmp_path / "binary.csv"):
        with pytest.raises(swarm.SwarmError, match="cannot read") as caught:
            swarm.Particles.from_csv(path)
        assert str(path) in str(caught.value)
