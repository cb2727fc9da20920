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
from springbeam.pictures.diagrams import Diagram, draw_diagrams
from springbeam.pictures.drawing import EVENT_LOOKS, NOT_RESOLVED, decimated
from springbeam.pictures.plots import figure_of, plot_run
from springbeam.results.directory import PICTURES

#: Which are not drawn: of a run without a beam, and of one that stopped before its tip met anything.
OF_A_BEAM = {"shapes_after_contact", "shapes_later", "moments"}
AFTER_CONTACT = {"shapes_later", "moments"}


@pytest.mark.parametrize(
    ("has", "rows", "missing"),
    [
        ("no spring", 400, set()),
        ("spring", 400, OF_A_BEAM),
        ("all", 1, set(PICTURES)),
        ("all", 2, AFTER_CONTACT),
    ],
)
def test_a_run_gets_the_pictures_of_what_it_has(tmp_path, unpainted, has, rows, missing):
    """From its second row on."""
    style = dict(matplotlib.rcParams)
    whole = a_trajectory(SCENES[has])
    columns = {name: values[:rows] for name, values in whole.columns.items()}
    shapes = None if whole.shape_table is None else whole.shape_table[:rows]
    written = plot_run(dataclasses.replace(whole, columns=columns, shape_table=shapes), tmp_path, PICTURES)
    assert dict(matplotlib.rcParams) == style  # none is left behind
    assert sorted(written) == sorted(tmp_path.iterdir())
    assert [path.name for path in written] == [file for name, file in PICTURES.items() if name not in missing]


def test_odd_columns_are_drawn_without_a_warning(tmp_path, recwarn, monkeypatch):
    monkeypatch.setattr(plots, "DPI", 40)
    drawn = ("shapes_after_contact", "velocities_and_forces", "gap_and_energy")
    for path in plot_run(a_trajectory(events=EVERY_EVENT, **ODD_COLUMNS), tmp_path, drawn):
        assert imread(path)[..., :3].std() > 0.02  # not blank
    assert [str(warning.message) for warning in recwarn] == []


# -- what is in them ----------------------------------------------------------------------------------------------


def texts(figure):
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text) if text.get_text()]


@pytest.mark.parametrize("picture", PICTURES)
def test_axes_have_quantities_and_units_and_the_key_names_phases_and_events(picture):
    run = a_trajectory(events=EVERY_EVENT)
    run.summary["resolved"] = False
    figure = figure_of(run, picture)
    assert all(ax.get_ylabel().endswith("]") for ax in figure.axes)
    if picture in OF_A_BEAM:
        *axes, key = figure.axes
        assert {ax.get_xlabel() for ax in axes} == {"position along the beam x [m]"}
        assert key.get_ylabel().startswith("time t [")
    else:
        assert figure.axes[-1].get_xlabel() == "time t [s]"
        key = {text.get_text() for text in figure.legends[0].get_texts()}
        assert {"free", "tied (u = y < Ψ)", *(f"{look.words} (1)" for look in EVENT_LOOKS.values())} <= key
    assert NOT_RESOLVED in texts(figure)


@pytest.mark.parametrize("summary", [{"resolved": True}, {}])
def test_a_run_that_is_resolved_has_no_mark(summary):
    run = dataclasses.replace(a_trajectory(), summary=summary)
    for picture in ("positions", "moments"):
        assert NOT_RESOLVED not in texts(figure_of(run, picture))


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


@pytest.mark.parametrize(
    ("picture", "contact"),
    [
        ("overview", {}),
        ("velocities_and_forces", {"law": "compliance", "damping": 0.5}),
        ("gap_and_energy", {"law": "compliance", "damping": 0.5}),
        ("loads_and_clamp", {}),
    ],
)
def test_nothing_written_over_time_is_cut_off_or_lies_on_anything_else(picture, contact):
    scene = with_changes(PAIR, contact=contact)
    events = [Event(0.3 + 1e-3 * k, kind, 0, 0, 0, 0, 1e-3, 0.6, 0.1) for k in range(40) for kind in EVENT_LOOKS]
    run = a_trajectory(scene.model_copy(update={"title": LONG}), events=events)
    run.summary |= {"resolved": False, "contact_force_max": 9.98, "contact_force_window": 3.28e-4}
    run.summary |= {"contact_force_max_time": 0.3}
    assert_nothing_collides(figure_of(run, picture))


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


def test_a_curve_on_logarithmic_axes_leaves_out_what_is_not_above_zero():
    """matplotlib would draw it at the edge."""
    curve = [[1.0, 2.0], [2.0, 0.0], [0.0, 3.0], [3.0, 4.0]]
    (ax,) = draw_diagrams([Diagram("x", "y", {"a": curve})], "").axes
    assert ax.lines[0].get_xydata().tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
