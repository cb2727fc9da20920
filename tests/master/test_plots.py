"""Pictures: which are drawn, what is in them, and that thinning keeps extremes."""

import dataclasses

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from matplotlib.image import imread
from runs import EVERY_EVENT, ODD_COLUMNS, PAIR, SCENES, a_trajectory

from springbeam import Event, with_changes
from springbeam.pictures import plots
from springbeam.pictures.drawing import (
    EVENT_LOOKS,
    NOT_RESOLVED,
    decimated,
    phase_intervals,
    power_of_ten,
    readable_unit,
)
from springbeam.pictures.frames import frames_of, sketches
from springbeam.pictures.panels import panels
from springbeam.pictures.plots import figure_of, plot_run
from springbeam.results.directory import PICTURES

OVERVIEW, A, B, C, D, E, F, G = PICTURES.values()
DRAWN = {
    **dict.fromkeys(("all", "no stop", "no spring", "beam"), (OVERVIEW, A, B, C, D, E, F, G)),
    **dict.fromkeys(("no beam", "spring"), (OVERVIEW, C, D, E, F)),
}  # fmt: skip


def test_the_overview_is_drawn_without_a_formula(tmp_path, monkeypatch):
    """A formula takes as long as all other texts together."""
    monkeypatch.setattr(matplotlib.mathtext.MathTextParser, "parse", None)
    assert plot_run(a_trajectory(events=EVERY_EVENT), tmp_path)


@pytest.mark.parametrize(("value", "text"), [(1e-12, "10⁻¹²"), (1.0, "10⁰"), (1e3, "10³")])
def test_a_power_of_ten_is_plain_text(value, text):
    assert power_of_ten(value) == text


@pytest.mark.parametrize("has", SCENES)
def test_a_scene_gets_the_pictures_of_what_it_has(tmp_path, unpainted, has):
    style = dict(matplotlib.rcParams)
    written = plot_run(a_trajectory(SCENES[has]), tmp_path, PICTURES)
    assert dict(matplotlib.rcParams) == style  # none is left behind
    assert sorted(written) == sorted(tmp_path.iterdir())
    assert tuple(path.name for path in written) == DRAWN[has]


@pytest.mark.parametrize(("rows", "drawn"), [(0, []), (1, []), (2, [OVERVIEW, A, C, D, E, F])])
def test_a_run_that_stopped_at_once_is_drawn_from_its_second_row_on(tmp_path, unpainted, rows, drawn):
    whole = a_trajectory()
    columns = {name: values[:rows] for name, values in whole.columns.items()}
    short = dataclasses.replace(whole, columns=columns, shape_table=whole.shape_table[:rows])
    assert [path.name for path in plot_run(short, tmp_path, PICTURES)] == drawn


@pytest.mark.parametrize("columns", ODD_COLUMNS.values(), ids=ODD_COLUMNS)
def test_odd_columns_are_drawn_without_a_warning(tmp_path, recwarn, monkeypatch, columns):
    monkeypatch.setattr(plots, "DPI", 40)
    for path in plot_run(a_trajectory(events=EVERY_EVENT, **columns), tmp_path, PICTURES):
        assert imread(path)[..., :3].std() > 0.02  # not blank
    assert [str(warning.message) for warning in recwarn] == []


# -- what is in them ----------------------------------------------------------------------------------------------


def texts(figure):
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text) if text.get_text()]


@pytest.mark.parametrize("picture", PICTURES)
def test_axes_have_quantities_and_units_and_the_key_names_phases_and_events(picture):
    run = a_trajectory(events=EVERY_EVENT)
    figure = figure_of(run, picture)
    along = picture.startswith("shapes") or picture == "moments"
    axes = figure.axes
    assert all(ax.get_ylabel().endswith("]") for ax in axes)
    if along:
        *axes, key = axes
        assert {ax.get_xlabel() for ax in axes} == {"position along the beam x [m]"}
        assert key.get_ylabel().startswith("time t [")
    else:
        assert axes[-1].get_xlabel() == "time t [s]"
        key = {text.get_text() for text in figure.legends[0].get_texts()}
        assert {"free", "tied (u = y < Ψ)", *(f"{look.words} (1)" for look in EVENT_LOOKS.values())} <= key
    for summary in ({"resolved": True}, {"resolved": False}, {}):
        marked = figure_of(dataclasses.replace(run, summary=summary), picture)
        assert (NOT_RESOLVED in texts(marked)) is not summary.get("resolved", True)


def test_every_panel_is_in_one_picture():
    run = a_trajectory(events=EVERY_EVENT)
    drawn = [
        ax.get_ylabel() for picture in plots._OVER_TIME if picture != "overview" for ax in figure_of(run, picture).axes
    ]
    assert sorted(drawn) == sorted(panel.axis for panel in panels(run))


def written(figure):
    """What is written but numbers at axes: title, mark, keys and quantities."""
    keys = [legend for legend in (*figure.legends, *(ax.get_legend() for ax in figure.axes)) if legend is not None]
    quantities = [axis.label for ax in figure.axes for axis in (ax.xaxis, ax.yaxis) if axis.get_visible()]
    found = [*figure.texts, *(text for key in keys for text in key.get_texts()), *quantities]
    return [text for text in found if text.get_text()]


def assert_nothing_collides(figure):
    """Nothing written is cut off, or lies on anything else that is, or on axes."""
    figure.canvas.draw()
    frames = [ax.get_window_extent() for ax in figure.axes]
    boxes = {text: text.get_window_extent() for text in written(figure)}
    for text, box in boxes.items():
        assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width, text
        assert 0.0 <= box.y0 < box.y1 <= figure.bbox.height, text
        others = [*frames, *(other for other in boxes.values() if other is not box)]
        assert not any(box.overlaps(other) for other in others), text


LONG = "A dropped package with a long name, which is wrapped where the picture ends, and goes on for more than a line"


@pytest.mark.parametrize("picture", plots._OVER_TIME)
@pytest.mark.parametrize("law", ["transmission", "compliance"])
def test_nothing_written_over_time_is_cut_off_or_lies_on_anything_else(picture, law):
    scene = with_changes(PAIR, contact={"law": law, **({"damping": 0.5} if law == "compliance" else {})})
    events = [Event(0.3 + 1e-3 * k, kind, 0, 0, 0, 0, 1e-3, 0.6, 0.1) for k in range(40) for kind in EVENT_LOOKS]
    run = a_trajectory(scene.model_copy(update={"title": LONG}), events=events)
    run.summary |= {"resolved": False, "contact_force_max": 9.98, "contact_force_window": 3.28e-4}
    run.summary |= {"contact_force_max_time": 0.3}
    figure = figure_of(run, picture)
    assert_nothing_collides(figure)


def test_the_overview_is_one_page_of_positions_velocities_forces_and_energy():
    figure = figure_of(a_trajectory(events=EVERY_EVENT), "overview")
    assert [ax.get_ylabel().split(" [")[0] for ax in figure.axes] == [
        "position", "velocity", "force", "impulse", "energy"
    ]  # fmt: skip
    assert figure.get_figheight() < 11.7  # A4


def test_a_short_beam_is_drawn_in_the_unit_of_its_axis():
    run = a_trajectory(with_changes(PAIR, beam={"length": 0.05}))
    ax = figure_of(run, "shapes_later").axes[0]
    assert (ax.get_xlabel(), ax.get_xlim()) == ("position along the beam x [mm]", (0.0, pytest.approx(50.0)))
    assert ax.collections[0].get_segments()[0][-1, 0] == pytest.approx(50.0)
    beam = sketches(run, frames_of(run))[0].strokes[2]
    assert (beam.part, beam.x[-1]) == ("beam", pytest.approx(50.0))


# -- panels: what plots and report draw over time ---------------------------------------------------------------------


def panel(name, run):
    (found,) = (panel for panel in panels(run) if panel.name == name)
    return found


def words_in(found):
    return {curve.look.words for curve in found.curves}


def test_energies_are_stacked_to_the_total_unless_one_is_negative():
    """By more than rounding."""
    found = panel("energies", a_trajectory())
    *parts, total = found.curves
    assert [curve.stacked for curve in found.curves] == [True] * 5 + [False]  # all but the loads, which are zero
    assert np.allclose(sum(curve.values for curve in parts), total.values, rtol=1e-14)
    assert panel("energies", a_trajectory(e_beam=np.full(400, 4.5e9))).axis == "energy [GJ]"
    assert panel("energies", a_trajectory(e_load=np.full(400, -1e-13))).curves[0].stacked
    lines = panel("energies", a_trajectory(e_spring=np.linspace(-1.0, 1.0, 400)))
    assert "spring" in words_in(lines)
    assert not any(curve.stacked for curve in lines.curves)


def test_the_residual_is_over_the_largest_energy_where_it_is_not_zero():
    zero, off = np.zeros(400), np.where(np.arange(400) % 2, -6e-9, 0.0)
    run = a_trajectory(e_beam=zero + 2.0, e_spring=zero + 1.0, e_contact=zero, e_total=zero + 3.0, energy_residual=off)
    found = panel("residual", run)
    assert found.axis == "energy residual [–]"
    assert found.curves[0].values == pytest.approx([2e-9] * 200, rel=1e-12)
    assert found.logarithmic == pytest.approx((0.6e-9, 6e-9), rel=1e-12)
    least = panel("residual", a_trajectory(energy_residual=1e-300 * run.time)).logarithmic[0]
    assert least == pytest.approx(0.3e-18, rel=1e-12, abs=0.0)


# -- thinning -----------------------------------------------------------------------------------------------------


@given(
    values=npst.arrays(float, st.integers(1, 3000), elements=st.floats(-1e6, 1e6)),
    columns=st.integers(2, 60),
)
def test_thinning_keeps_ends_order_and_the_extremes_of_every_column_of_pixels(values, columns):
    """A run of four rows a column, or fewer, is not thinned."""
    time = np.sort(np.random.default_rng(len(values)).random(len(values)))
    rows = decimated(time, values, columns)
    assert len(rows) <= 4 * columns if len(values) > 4 * columns else len(rows) == len(values)
    assert np.all(np.diff(rows) > 0)
    assert (rows[0], rows[-1]) == (0, len(values) - 1)
    edges = np.linspace(time[0], time[-1], columns + 1)[1:-1]
    for span in np.split(np.arange(len(values)), np.searchsorted(time, edges)):
        if len(span):
            kept = values[rows[np.isin(rows, span)]]
            assert (kept.min(), kept.max()) == (values[span].min(), values[span].max())


def test_phases_hold_until_the_next_row_and_are_sampled_in_proportion():
    few = np.array(["free", "free", "tied", "tied", "touch", "free"])
    intervals = phase_intervals(np.array([0.0, 1.0, 2.0, 3.0, 3.0, 4.0]), few)
    assert intervals == [("free", 0.0, 2.0), ("tied", 2.0, 3.0), ("touch", 3.0, 4.0)]
    time, phase = 7.0 + np.arange(40_000) / 4.0, np.where(np.arange(40_000) % 4 == 0, "tied", "free")
    intervals = phase_intervals(time, phase, 999)
    assert len(intervals) <= 1000
    assert (intervals[0][1], intervals[-1][2]) == (time[0], time[-1])
    half = 0.5 * np.ptp(time) / 999
    assert [name for name, _, _ in intervals] == [phase[int(4.0 * (at + half - 7.0))] for _, at, _ in intervals]


@pytest.mark.parametrize(
    ("largest", "unit", "expected"),
    [
        (0.0, "m", (1.0, "m")),
        (0.1, "m", (1.0, "m")),
        (9999.0, "N", (1.0, "N")),
        (0.015, "m", (1e3, "mm")),
        (4.4e-6, "m", (1e6, "µm")),
        (4.5e9, "J", (1e-9, "GJ")),
        (1e-30, "J", (1e12, "pJ")),
        (1e30, "J", (1e-12, "TJ")),
    ],
)
def test_readable_units(largest, unit, expected):
    factor, name = readable_unit([np.array([0.0, -largest]), np.array([])], unit)
    assert (factor, name) == (pytest.approx(expected[0], rel=1e-15), expected[1])
