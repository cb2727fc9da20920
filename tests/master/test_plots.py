"""Pictures: which are drawn, and that thinning keeps extremes."""

import dataclasses

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from runs import SCENES, a_trajectory

from springbeam.pictures.drawing import decimated
from springbeam.pictures.plots import plot_run
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
