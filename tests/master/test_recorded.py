"""Files of measured columns: what is read of them, what is refused, and what is said of it."""

import re

import numpy as np
import pytest
from scenes import load_of, table

from springbeam.scene.recorded import Reading, Recorded
from springbeam.scene.units import factor


def read(path, content, **keys):
    """The rows (time, value) of a file in metres, and what was done to them."""
    path.write_bytes(content)
    found = Recorded(path, Reading(**keys))
    times, columns = found.read({1 - found.time: "m"})
    return np.column_stack([times, *columns.values()]).tolist(), found.notes


@pytest.fixture
def file(tmp_path):
    return tmp_path / "record.csv"


TABLE = table("master/recorded.toml")
#: Python's name of an encoding, and what has to be said of it.
ENCODINGS = {"utf-8": None, "utf-8-sig": None, "utf-16": None, "utf-16-le": "utf-16-le", "latin-1": "latin-1"}


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_file_is_read_in_its_encoding(file, encoding):
    content = "time [ms],höhe [µm]\n0,1\n500,2.5\n".encode(encoding)
    said = ENCODINGS[encoding]
    rows, notes = read(file, content, **({"encoding": said} if said else {}))
    assert (rows, notes) == ([pytest.approx([0.0, 1e-6]), pytest.approx([0.5, 2.5e-6])], [])
    if said:
        with pytest.raises(ValueError, match=rf'it is no text in utf-8.*give its encoding, as encoding = "{said}"'):
            read(file, content)


@pytest.mark.parametrize("what", TABLE["read"])
def test_what_a_bench_writes_is_read_as_it_is_said_to(file, what):
    keys = dict(TABLE["read"][what])
    text, due, said = (keys.pop(name) for name in ("text", "rows", "said"))
    rows, notes = read(file, text.encode(), **keys)
    assert rows == [pytest.approx(row) for row in due]
    assert notes == said


@pytest.mark.parametrize("what", TABLE["refused"])
def test_nothing_is_guessed(file, what):
    keys = dict(TABLE["refused"][what])
    text = keys.pop("text")
    said = keys.pop("said")
    with pytest.raises(ValueError, match=re.escape(said)):
        read(file, text.encode(), **keys)


#: Spellings of units, and how many m/s² each is; `None`: refused.
ACCELERATIONS = {
    **dict.fromkeys(("m/s²", "m/s^2", "m/s2", "m s-2", "m s^-2", "m.s-2", "m·s⁻²", "m*s**-2", "m/s/s", "µm/ms²"), 1.0),
    **dict.fromkeys(("g", "G", "gn", "g_n", "g0"), 9.80665),
    "mg": 9.80665e-3,
    "Gal": 1e-2,
    "mm/s2": 1e-3,
    "in/s²": 0.0254,
    **dict.fromkeys(("m/s", "(", "3", "m/", "m s-", "foo", "m/s2)", "-", "lambda", "kg", "degC", "1/s"), None),
}


@pytest.mark.parametrize("unit", ACCELERATIONS)
def test_an_acceleration_is_read_in_any_spelling_of_its_unit(unit):
    due = ACCELERATIONS[unit]
    if due is None:
        with pytest.raises(ValueError, match=re.escape(f"[{unit}] is no unit")):
            factor(unit, "m/s²")
    else:
        assert factor(unit, "m/s²") == pytest.approx(due, rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "wanted", "due"), [("Nm", "N·m", 1.0), ("lbf", "N", 4.4482216152605), ("N/mm²", "Pa", 1e6)]
)
def test_other_quantities_have_the_units_of_their_field(unit, wanted, due):
    assert factor(unit, wanted) == pytest.approx(due, rel=1e-15)


def test_a_load_takes_the_same_keys(file):
    file.write_text("t [s];F [kN]\n0;1,5\n1;\n2;2,5\n")
    load = load_of(on="tip", signal="table", file=str(file), decimal=",", missing="drop")
    assert load.value([0.0, 1.0]).tolist() == [1500.0, 2000.0]
    assert load.notes == ["1 lines of 3 dropped, where a value is missing"]
