"""Time series in axes: linear with a band where all is round-off, one colour for an energy, everything drawn once."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text

import swarm
from swarm.pictures import colours, graphs, plots, series, speeds, style
from swarm.recording import looks
from swarm.words import verdicts

TIMES = np.linspace(0.0, 1.0, 11)
SPHERE = swarm.Scene([swarm.Sphere(0.5)])


def axes_of(graph, curves, plane=None, **keywords):
    with style.applied():
        axes = style.picture(4.0, 3.0).subplots()
        graphs.lines(axes, series.GRAPHS[graph].across(plane), curves, **keywords)
    return axes


def texts(axes):
    return [text.get_text() for text in axes.texts]


def content_of(method, scene=SPHERE, start=None, **keywords):
    start = swarm.fill(scene, 20, speed=1.0, seed=1) if start is None else start
    keywords = {"until": 2.0, "every": 0.2} | keywords
    result = swarm.simulate(scene, start, method, compile="never", **keywords)
    return plots.Content(
        "", scene, method, None, len(result.particles), dict(result.observables), {"end": result.particles}
    )


def drawn(content):
    figure = plots.figure_of(content, None, 100)
    return {axes.get_ylabel(): axes for axes in figure.axes if axes.axison}, figure


# --- Errors --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("worst", [2e-16, 6.7e-16, 3e-13])
def test_round_off_is_on_a_linear_axis_in_a_band(worst):
    """From 0, with the largest in words; the band covers all of it."""
    errors = np.log10(np.maximum(np.linspace(0.0, worst, 11), 1e-18))
    axes = axes_of("energy_error", {"of a particle": (TIMES, errors)})
    assert axes.get_yscale() == "linear"
    low, high = axes.get_ylim()
    assert low == 0.0
    assert worst < high <= 2.0 * worst
    (band,) = axes.patches
    assert band.get_extents().y0 <= axes.transData.transform((0.0, 0.0))[1]
    assert band.get_height() == pytest.approx(high)
    assert any("round-off" in text and "at most" in text for text in texts(axes))
    np.testing.assert_allclose(axes.lines[0].get_ydata(), np.linspace(0.0, worst, 11), atol=1e-18)


def test_errors_that_are_none_are_words():
    axes = axes_of("penetration", {"of a particle": (TIMES, np.full(11, series.NOTHING))})
    assert texts(axes) == ["none in any frame"]
    assert not axes.lines


def test_decades_above_round_off_are_logarithmic_without_a_zero():
    errors = np.array([series.NOTHING, *np.linspace(-13.0, -3.0, 10)])
    axes = axes_of("energy_error", {"of a particle": (TIMES, errors)})
    assert axes.get_yscale() == "log"
    assert axes.get_ylim()[0] > 1e-15
    assert not any(text.endswith("round-off") and "at most" in text for text in texts(axes))


def test_a_drift_of_verlet_is_linear_and_no_round_off():
    cells, _figure = drawn(content_of(swarm.Verlet(5e-3, 1e4)))
    axes = cells["relative error"]
    assert axes.get_yscale() == "linear"
    assert not any("round-off" in text for text in texts(axes))


def test_an_axis_is_bounded_by_its_round_off():
    """Where the limit is within the axis the band ends there."""
    axes = axes_of("penetration", {"of a particle": (TIMES, np.full(11, -6.0))}, limit=5e-7)
    assert axes.get_ylabel() == "depth [µm]"
    (band,) = axes.patches
    assert band.get_height() == pytest.approx(0.5)


# --- Energies and rates ---------------------------------------------------------------------------------------


def test_a_constant_energy_is_seen_to_be():
    """From 0, with the unit that readers expect, and once where all of it is kinetic."""
    total = np.full(11, 2.4e-3) * (1.0 + 1e-15 * np.arange(11))
    axes = axes_of("energy", {"total": (TIMES, total), "kinetic": (TIMES, total)})
    low, high = axes.get_ylim()
    assert low == 0.0
    assert high < 3.0
    assert axes.get_ylabel() == "energy [mJ]"
    assert [line.get_label() for line in axes.lines] == ["total, all kinetic"]


def test_energies_have_one_colour_everywhere():
    """Whatever others there are; the total has that of text."""
    curves = {name: (TIMES, TIMES + k) for k, name in enumerate(["total", *colours.ENERGIES])}
    expected = {name: to_hex(colour) for name, colour in colours.ENERGIES.items()}
    for some in (list(curves), ["total", "potential"], ["dissipated", "kinetic", "total"]):
        found = {line.get_label(): to_hex(line.get_color()) for line in
                 axes_of("energy", {name: curves[name] for name in some}).lines}  # fmt: skip
        assert {name: found[name] for name in some if name in expected and name in found} == {
            name: expected[name] for name in some if name in expected and name in found
        }
        assert found["total"] == "#222222"
    assert len({c for name, c in expected.items() if name != "elastic"}) == len(expected) - 1


def test_recordings_have_the_same_colours():
    """Of the same table."""
    logged = {}

    class Stream:
        def log(self, path, what, static):
            logged[path] = what

    lines = [series.Line(f"/energy/{name}", name, "x") for name in ("total", "potential", "dissipated")]
    looks.log_series(Stream(), lines)
    for line in lines[1:]:
        (packed,) = logged[line.path].colors.as_arrow_array().to_pylist()
        assert f"#{packed >> 8:06X}" == colours.ENERGIES[line.name]


def test_rates_are_steps_from_the_start():
    axes = axes_of("impacts", {"all particles": (TIMES[1:], np.arange(1.0, 11.0) * 2e4)})
    (line,) = axes.lines
    assert line.get_drawstyle() == "steps-pre"
    assert line.get_xdata()[0] == pytest.approx(0.0)
    assert axes.yaxis.get_major_formatter()(1e5) == "100 k"
    assert axes_of("impacts", {"a": (TIMES, TIMES * 2e4)}).yaxis.get_major_formatter()(1e4) == "10 000"


def test_many_walls_are_one_mean():
    """And the colours of many are not used twice; a few have their names at their ends."""
    many = {f"plane {k}": (TIMES, np.full(11, float(k))) for k in range(24)}
    axes = axes_of("pressure", many)
    assert texts(axes) == ["mean of 24"]
    np.testing.assert_allclose(axes.lines[-1].get_ydata(), 11.5)
    assert {to_hex(line.get_color()) for line in axes.lines[:-1]} == {style.GREY.lower()}
    few = axes_of("pressure", dict(list(many.items())[:5]))
    assert texts(few) == [f"plane {k}" for k in range(5)]
    heights = [text.get_position()[1] for text in few.texts]
    assert np.diff(heights).min() > 0.08
    assert few.get_legend() is None


def test_one_wall_is_in_the_title():
    axes = axes_of("pressure", {"ellipsoid": (TIMES, TIMES * 2e3)})
    assert (axes.get_title(), axes.get_ylabel(), texts(axes)) == ("Pressure on the ellipsoid", "pressure [kPa]", [])


@pytest.mark.parametrize(
    ("graph", "plane", "unit"), [("pressure", None, "Pa"), ("force", None, "N"), ("pressure", "z", "N/m")]
)
def test_the_pressure_of_few_molecules_is_labelled_as_theirs(graph, plane, unit):
    axes = axes_of(graph, {"sphere": (TIMES, TIMES * 2e-17)}, plane)
    assert axes.get_ylabel() == f"{graph} [{unit}]\nof the simulated particles"
    assert "10⁻¹⁷" in axes.yaxis.get_major_formatter()(1e-17)
    assert "simulated" not in axes_of(graph, {"sphere": (TIMES, TIMES * 2e-9)}).get_ylabel()
    assert "simulated" not in axes_of("heat", {"sphere": (TIMES, TIMES * 2e-17)}).get_ylabel()
    # None at all
    assert "simulated" not in axes_of(graph, {"sphere": (TIMES, TIMES * 0.0)}).get_ylabel()


def test_no_frames_are_words():
    empty = np.zeros(0)
    assert texts(axes_of("impacts", {"all particles": (empty, empty)})) == ["needs two frames"]


# --- All of a run ---------------------------------------------------------------------------------------------


def test_every_observable_is_drawn_once():
    """Each curve shows its own number of its own observable."""
    walls = [swarm.Sphere(0.5, laws=[swarm.Absorb(0.05)], openings=[swarm.Sphere(0.2, (0.0, 0.0, 0.5))])]
    scene = swarm.Scene(walls)
    content = content_of(
        swarm.Impact(), scene, until=4.0, sources=[swarm.Source(0, rate=5.0, speed=1.0)], seed=1,
        counters=[swarm.Plane((1.0, 0.0, 0.0)), swarm.Sphere(0.2)],
    )  # fmt: skip
    seen = plots._with_inside(content)
    lines = series.lines_of(scene, content.method, [], None, seen)
    shown = [(line.observable, line.surface, line.along, line.per) for line in lines]
    assert len(set(shown)) == len(shown)
    assert len({line.path for line in lines}) == len(lines)
    assert {"inside", "born", "escaped", "absorbed", "crossings"} <= {line.observable for line in lines}
    gone = seen["escaped"] + seen["absorbed"].sum(axis=1)
    np.testing.assert_array_equal(seen["inside"] + gone, 20 + seen["born"].sum(axis=1))
    cells, _figure = drawn(content)
    assert {"particles", "crossings [1/s]", "net flow [1/s]"} <= set(cells)
    by_name = {line.path: line.values(content.seen["time"], seen) for line in lines}
    np.testing.assert_allclose(by_name["/flow/0"], by_name["/crossings/0_out"] - by_name["/crossings/0_back"])


def test_walls_that_are_moved_are_drawn():
    walls = [swarm.Cylinder(0.2), swarm.Plane((0.0, 0.0, -1.0)),
             swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=2.0, motion=swarm.Guide((0, 0, 1), stiffness=40.0))]  # fmt: skip
    scene = swarm.Scene(walls)
    start = swarm.Particles([0.0, 0.0, 0.1], [0.0, 0.0, 1.0])
    content = content_of(swarm.Impact(), scene, start)
    cells, _figure = drawn(content)
    (axes,) = (axes for label, axes in cells.items() if label.startswith("displacement"))
    (line,) = (line for line in axes.lines if len(line.get_xdata()) == 11)
    np.testing.assert_allclose(
        line.get_ydata() * (1e-3 if "[mm]" in axes.get_ylabel() else 1.0),
        content.seen["wall_position"][:, 2, 2],
        atol=1e-12,
    )


@pytest.mark.parametrize("until", [0.2, 2.0])
def test_plots_fill_the_sheet_and_say_what_runs(until):
    """No empty axes; the title in words; verdicts below."""
    content = content_of(swarm.Impact(), until=until)
    cells, figure = drawn(content)
    assert figure.get_suptitle() == f"20 particles in a sphere: Impact, {until:g} s"
    assert all(axes.has_data() for axes in cells.values())
    assert "depth [m]" not in cells
    headings = [text.get_text() for part in figure.findobj(type(figure.subfigs[0])) for text in part.texts]
    for verdict in verdicts.judged(content):
        assert verdict.label == "numbers" or any(verdict.text[:30] in text.replace("\n    ", " ") for text in headings)


# --- Speeds ---------------------------------------------------------------------------------------------------


def test_one_speed_is_no_histogram():
    content = content_of(swarm.Impact())
    assert speeds.of_frames(content) == {}
    assert speeds.of_all(content) == pytest.approx(1.0)
    cells, figure = drawn(content)
    assert not any("bins" in label for label in cells)
    assert any(text.get_text().endswith("each with 1 m/s") for text in figure.findobj(Text))


@pytest.mark.parametrize(("plane", "dimensions"), [(None, 3), ("z", 2)])
def test_the_law_of_maxwell_is_drawn_where_speeds_are_near_it(plane, dimensions):
    """On a linear axis, with the mean energy of the particles; not beside speeds that are spread in another way."""
    walls = swarm.Scene([swarm.Sphere(0.5)] if plane is None else [swarm.Cylinder(0.5)], plane=plane)
    hot = swarm.fill(walls, 4000, temperature=1.0, seed=1)
    cells, _figure = drawn(content_of(swarm.Impact(), walls, hot, until=1e-3, every=1e-3))
    axes = cells["% in each of 50 bins"]
    assert axes.get_yscale() == "linear"
    (law,) = (line for line in axes.lines if line.get_label().startswith("Maxwell"))
    bars = np.add.reduceat(law.get_ydata(), np.arange(0, 400, 8)) / 8.0
    assert bars.sum() == pytest.approx(100.0, rel=0.01)
    assert hot.velocity.shape[0] == 3
    assert law.get_xdata()[law.get_ydata().argmax()] == pytest.approx(np.sqrt(dimensions - 1.0), rel=0.05)
    even = swarm.Particles(
        hot.position, hot.velocity / np.sqrt((hot.velocity**2).sum(axis=0)) * np.linspace(0.9, 1.1, 4000)
    )
    cells, _figure = drawn(content_of(swarm.Impact(), walls, even, until=1e-3, every=1e-3))
    assert not [line for line in cells["% in each of 50 bins"].lines if line.get_label().startswith("Maxwell")]
