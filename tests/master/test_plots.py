"""Pictures: which are drawn, what is in them, and that thinning keeps extremes."""

import dataclasses

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from matplotlib.axes import Axes
from matplotlib.image import imread
from runs import EVERY_EVENT, ODD_COLUMNS, PAIR, SCENES, a_trajectory

from springbeam.pictures import comparison, plots, timeline
from springbeam.pictures.drawing import (
    EVENT_LOOKS,
    NOT_RESOLVED,
    alternates,
    decimated,
    phase_intervals,
    readable_unit,
    shaded_phases,
)
from springbeam.pictures.panels import panels
from springbeam.pictures.plots import figure_of, plot_run
from springbeam.results.directory import PICTURES
from springbeam.results.trajectory import Event
from springbeam.scene import with_changes
from springbeam.scene.statics import SHAPE_POINTS

A, B, C, D, E, F = PICTURES


# -- which pictures -----------------------------------------------------------------------------------------------


DRAWN = {
    "all": PICTURES, "no stop": PICTURES, "no spring": PICTURES, "beam": (A, B, C, E, F), "no beam": (C, D, E, F),
    "spring": (C, E, F),
}  # fmt: skip


@pytest.mark.parametrize("has", SCENES)
def test_a_scene_gets_the_pictures_of_what_it_has(tmp_path, has):
    style = dict(matplotlib.rcParams)
    written = plot_run(a_trajectory(SCENES[has]), tmp_path)
    assert dict(matplotlib.rcParams) == style  # none is left behind
    assert tuple(path.name for path in written) == DRAWN[has]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(DRAWN[has])
    for path in written:
        image = imread(path)
        assert image.shape[1] == round(timeline.WIDTH * timeline.DPI)
        assert image[..., :3].std() > 0.02  # not blank


@pytest.mark.parametrize(("rows", "drawn"), [(0, []), (1, []), (2, [A, C, D, E, F])])
def test_a_run_that_stopped_at_once_is_drawn_from_its_second_row_on(tmp_path, rows, drawn):
    whole = a_trajectory()
    columns = {name: values[:rows] for name, values in whole.columns.items()}
    short = dataclasses.replace(whole, columns=columns, shapes=tuple(values[:rows] for values in whole.shapes))
    assert [path.name for path in plot_run(short, tmp_path)] == drawn


@pytest.mark.parametrize("columns", ODD_COLUMNS.values(), ids=ODD_COLUMNS)
def test_odd_columns_are_drawn_without_a_warning(tmp_path, recwarn, monkeypatch, columns):
    monkeypatch.setattr(plots, "DPI", 40)
    plot_run(a_trajectory(events=EVERY_EVENT, **columns), tmp_path)
    assert [str(warning.message) for warning in recwarn] == []


# -- what is in them ----------------------------------------------------------------------------------------------


def texts(figure):
    found = [text.get_text() for text in figure.findobj(matplotlib.text.Text)]
    return [text for text in found if text]


@pytest.mark.parametrize("picture", plots._DRAWINGS)
def test_axes_have_quantities_and_units_and_the_key_names_phases_and_events(picture):
    figure = figure_of(a_trajectory(events=EVERY_EVENT), picture)
    if picture.startswith("shapes"):
        axes = figure.axes[:2]
        assert {ax.get_xlabel() for ax in axes} == {"position along the beam x [m]"}
        assert any(text.startswith("time t [") for text in texts(figure))
    else:
        axes = figure.axes
        assert axes[-1].get_xlabel() == "time t [s]"
        key = {text.get_text() for text in figure.legends[0].get_texts()}
        assert {"free", "tied (u = y < Ψ)", *(f"{look.words} (1)" for look in EVENT_LOOKS.values())} <= key
    for ax in axes:
        assert ax.get_ylabel().endswith("]")


def test_shapes_start_at_first_contact():
    t_c = 0.2
    figure = plots._shapes_after_contact(a_trajectory(events=[Event(0.1, "separation"), Event(t_c, "impact")]))
    curves, velocities = (ax.collections[0] for ax in figure.axes[:2])
    first = curves.get_array()[0]
    assert t_c <= first < t_c + 0.6 / 399
    assert len(curves.get_segments()) == plots._SHAPES_EARLY
    assert len(velocities.get_segments()) == plots._SHAPES_EARLY - 1
    times = curves.get_array()
    assert np.allclose(velocities.get_array(), 0.5 * (times[1:] + times[:-1]), rtol=1e-12)


def test_shapes_too_far_apart_for_the_motion_say_so():
    fast = a_trajectory(v_tip=np.full(400, 1e3))
    assert any("1 km/s" in text or "1e+03 m/s" in text for text in texts(plots._shapes_after_contact(fast)))
    t = np.linspace(0.0, 0.6, 400)
    inner = np.outer(t, np.sin(np.pi * SHAPE_POINTS))  # 1 m/s in the middle, the tip at rest but for its bounces
    bouncing = dataclasses.replace(a_trajectory(v_tip=np.full(400, 0.5)), shapes=(t, inner))
    for slow in (a_trajectory(), bouncing):
        assert not any("faster than the steps" in text for text in texts(plots._shapes_after_contact(slow)))


FLIPS = np.where(np.arange(400) % 2, 1.0, -1.0)


def test_shapes_that_alternate_are_drawn_in_pairs():
    unresolved = a_trajectory()
    unresolved.shapes[1][:] = np.outer(FLIPS, SHAPE_POINTS)
    figure = plots._shapes_later(unresolved)
    assert any("they alternate" in text for text in texts(figure))
    assert {curve[-1, 1] for curve in figure.axes[0].collections[0].get_segments()} == {-1.0, 1.0}


@pytest.mark.parametrize("picture", plots._DRAWINGS)
def test_every_picture_of_a_run_that_is_not_resolved_carries_the_mark(picture):
    for resolved in (True, False):
        run = dataclasses.replace(a_trajectory(), summary={"resolved": resolved})
        assert (NOT_RESOLVED in texts(figure_of(run, picture))) is not resolved


def test_panels_are_painted_with_all_that_they_say():
    run = a_trajectory(contact_force=FLIPS, compliance_force=np.full(400, 1e-9))
    (forces,) = (ax for ax in figure_of(run, "velocities_and_forces").axes if ax.get_ylabel() == "force [N]")
    (remark,) = [" ".join(text.get_text().split()) for text in forces.texts]
    assert remark.count("alternates") == 1
    assert "too small to draw: part λ(Ψ − u)₊ᵖ ≤ 1e-09 N" in remark
    assert {line.get_label() for line in forces.lines if line.get_label()[0] != "_"}.isdisjoint({"part λ(Ψ − u)₊ᵖ"})
    assert {"Ψ", "φ"} <= set(texts(figure_of(run, "positions")))
    energies = figure_of(run, "gap_and_energy").axes[1]
    assert len(energies.collections) > 3
    assert [line.get_label() for line in energies.lines if line.get_label()[0] != "_"] == ["total"]


def test_what_is_compared_is_drawn_in_the_unit_of_its_axis(tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(comparison.Figure, "savefig", lambda figure, *_, **__: figures.append(figure))
    run = a_trajectory()
    comparison.draw({"one": run}, tmp_path / "compared.png")
    units = {"u_tip": "[mm]", "v_tip": "[mm/s]", "contact_force": "[mN]"}
    for ax, (column, unit) in zip(figures[0].axes, units.items(), strict=False):
        assert ax.get_ylabel().endswith(unit)
        assert np.abs(ax.lines[0].get_ydata()).max() == pytest.approx(1e3 * np.abs(run[column]).max(), rel=1e-12)


# -- panels: what plots and report draw over time ---------------------------------------------------------------------


def panel(name, run):
    (found,) = (panel for panel in panels(run) if panel.name == name)
    return found


def words_in(found):
    return {curve.look.words for curve in found.curves}


def test_a_motion_lost_in_the_other_is_enlarged():
    t = np.linspace(0.0, 0.6, 400)
    run = a_trajectory(u_tip=2e-6 * np.sin(9.0 * t), y=-1e-2 * np.sin(5.0 * t))
    assert [p.axis for p in panels(run)][:3] == ["position [mm]", "position [µm]", "velocity [mm/s]"]
    assert [p.axis for p in panels(a_trajectory())][:2] == ["position [mm]", "velocity [mm/s]"]


@pytest.mark.parametrize(
    ("law", "phase", "force"),
    [
        ("compliance", "in contact (u < y)", "of the law λ(y − u)₊ᵖ"),
        ("link", "joined by the link", "of the link λ(y − u)"),
        ("tie", "tied (u = y)", "part λ(Ψ − u)₊ᵖ"),
        ("transmission", "touch (y ≥ Ψ)", "part λ(Ψ − u)₊ᵖ"),
    ],
)
def test_phases_and_forces_have_the_words_of_the_law(law, phase, force):
    scene = with_changes(PAIR, contact={"law": law})
    joined = "touch" if law in ("compliance", "transmission") else "tied"
    run = a_trajectory(scene, phase=np.where(np.arange(400) < 200, joined, "free"))
    assert [look.words for look, _ in shaded_phases(run)] == [phase, "free"]
    assert force in words_in(panel("forces", run))


def test_energies_are_stacked_to_the_total_unless_one_is_negative_and_those_too_small_are_named():
    found = panel("energies", a_trajectory())
    *parts, total = found.curves
    assert [curve.stacked for curve in found.curves] == [True] * 5 + [False]  # all but the loads, which are zero
    assert np.allclose(sum(curve.values for curve in parts), total.values, rtol=1e-14)
    stiff = panel("energies", a_trajectory(e_beam=np.full(400, 4.5e9)))
    assert stiff.axis == "energy [GJ]"
    assert "spring ≤ 0.01\u00a0J" in stiff.remarks[0]
    lines = panel("energies", a_trajectory(e_spring=np.linspace(-1.0, 1.0, 400)))
    assert "spring" in words_in(lines)
    assert not any(curve.stacked for curve in lines.curves)


def test_residual_is_relative_to_the_largest_energy():
    trajectory = a_trajectory(e_beam=np.full(400, 3.0), energy_residual=np.full(400, -6e-12))
    stored = np.abs(trajectory.e_beam) + np.abs(trajectory.e_spring) + np.abs(trajectory.e_contact)
    for total in (0.0, 50.0):
        trajectory.columns["e_total"] = np.full(400, total)
        largest = max(stored.max(), total)
        assert np.allclose(panel("residual", trajectory).curves[0].values, 6e-12 / largest, rtol=1e-12, atol=0.0)


# -- thinning -----------------------------------------------------------------------------------------------------


@given(
    values=npst.arrays(float, st.integers(1, 3000), elements=st.floats(-1e6, 1e6)),
    columns=st.integers(2, 60),
)
def test_thinning_keeps_ends_order_and_the_extremes_of_every_column_of_pixels(values, columns):
    time = np.sort(np.random.default_rng(len(values)).random(len(values)))
    rows = decimated(time, values, columns)
    if len(values) <= 4 * columns:  # a short run is not thinned
        assert len(rows) == len(values)
    assert np.all(np.diff(rows) > 0)
    assert rows[0] == 0
    assert rows[-1] == len(values) - 1
    assert len(rows) <= 4 * columns
    edges = np.linspace(time[0], time[-1], columns + 1)[1:-1]
    for span in np.split(np.arange(len(values)), np.searchsorted(time, edges)):
        kept = rows[np.isin(rows, span)]
        if len(span):
            assert values[kept].min() == values[span].min()
            assert values[kept].max() == values[span].max()


def test_more_phases_than_pixels_are_sampled_in_proportion():
    time = np.arange(40_000) / 4.0
    phase = np.where(np.arange(40_000) % 4 == 0, "tied", "free")
    intervals = phase_intervals(time, phase, 999)
    assert len(intervals) <= 1000
    tied = sum(end - start for name, start, end in intervals if name == "tied")
    assert tied / time[-1] == pytest.approx(0.25, abs=0.05)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (np.where(np.arange(100) % 2, 1.0, -1.0), True),
        (np.where(np.arange(100) % 2, 1.0, -1.0) + np.sin(np.arange(100) / 9.0), True),
        (np.sin(np.linspace(0.0, 30.0, 400)), False),
        (np.sin(np.linspace(0.0, 30.0, 400)) + 1e-3 * np.where(np.arange(400) % 2, 1.0, -1.0), False),
        (np.zeros(100), False),
        (np.array([1.0, -1.0, 1.0]), False),
    ],
    ids=["flips", "flips on a wave", "wave", "ripple", "constant", "too short"],
)
def test_alternation(values, expected):
    assert alternates(values) is expected


@pytest.mark.parametrize(
    ("largest", "unit", "expected"),
    [
        (0.0, "m", (1.0, "m")),
        (0.6, "s", (1.0, "s")),
        (0.1, "m", (1.0, "m")),
        (9999.0, "N", (1.0, "N")),
        (0.015, "m", (1e3, "mm")),
        (3e-7, "m", (1e9, "nm")),
        (4.4e-6, "m", (1e6, "µm")),
        (4.5e9, "J", (1e-9, "GJ")),
        (2e4, "N", (1e-3, "kN")),
        (1e-30, "J", (1e12, "pJ")),
        (1e30, "J", (1e-12, "TJ")),
    ],
)
def test_readable_units(largest, unit, expected):
    factor, name = readable_unit([np.array([0.0, -largest]), np.array([])], unit)
    assert (factor, name) == (pytest.approx(expected[0], rel=1e-15), expected[1])


def test_a_peak_between_the_means_is_told_beside_the_curve():
    run = a_trajectory(contact_force=np.where(np.arange(400) == 200, 14.1, 1.0))
    run.summary |= {"contact_force_max": 9.98, "contact_force_window": 9.9e-3}
    said = "highest instant 14.1\u00a0N; largest mean over 9.9\u00a0ms, which the run tells, 9.98\u00a0N"
    assert said in panel("forces", run).remarks
    run.summary["contact_force_max"] = 14.0
    assert not any("largest mean" in remark for remark in panel("forces", run).remarks)


def test_runs_over_each_other_show_what_strikes_them(tmp_path, monkeypatch):
    """One run is seated, the other struck twice: it has stems, not only a force of zero."""
    drawn = []
    monkeypatch.setattr(Axes, "vlines", lambda ax, time, low, high, **_: drawn.append((ax.get_ylabel(), high)))
    strokes = [Event(t, "stop_impact", 0, 0, 0, 0, 0.0, 0.6, 0.0) for t in (0.1, 0.3)]
    zero = np.zeros(400)
    comparison.draw(
        {"seated": a_trajectory(), "struck": a_trajectory(events=strokes, foundation_force=zero)}, tmp_path / "a.png"
    )
    assert [high.tolist() for _, high in drawn] == [[0.6, 0.6]]
