"""Files of measured columns: what is read of them, what is refused, and what is said of it."""

import numpy as np
import pytest
from scenes import load_of

from springbeam.scene.recorded import Reading, Recorded


def read(path, content, **keys):
    """The rows (time, value) of a file in metres, and what was done to them."""
    path.write_bytes(content)
    found = Recorded(path, Reading(**keys))
    times, columns = found.read({1: "m"})
    return np.column_stack([times, columns[1]]).tolist(), found.notes


@pytest.fixture
def file(tmp_path):
    return tmp_path / "record.csv"


TEXT = "time [ms],höhe [µm]\n0,1\n500,2.5\n"
ROWS = [[0.0, 1e-6], [0.5, 2.5e-6]]
#: How a text is written, and what has to be said of that.
ENCODED = {
    "UTF-8": (TEXT.encode(), {}),
    "UTF-8 that says so": (TEXT.encode("utf-8-sig"), {}),
    "UTF-16 that says so": (TEXT.encode("utf-16"), {}),
    "UTF-16, big end first, that says so": (b"\xfe\xff" + TEXT.encode("utf-16-be"), {}),
    "UTF-16": (TEXT.encode("utf-16-le"), {"encoding": "utf-16-le"}),
    "Latin-1": (TEXT.encode("latin-1"), {"encoding": "latin-1"}),
    "lines of Windows": (TEXT.replace("\n", "\r\n").encode(), {}),
}


@pytest.mark.parametrize("encoded", ENCODED)
def test_a_file_is_read_in_its_encoding(file, encoded):
    content, keys = ENCODED[encoded]
    rows, notes = read(file, content, **keys)
    assert rows == [pytest.approx(row) for row in ROWS]
    assert notes == []
    if keys:
        with pytest.raises(ValueError, match=r'give its encoding, as encoding = "(utf-16-le|latin-1)"'):
            read(file, content)


#: What is written for a table, keys, rows in s and m, and what is said; [m] is assumed where no unit is given.
READ = {
    "decimal commas": ("t [s];y [m]\n0;1,5\n0,5;-2,5e-1", {"decimal": ","}, [[0.0, 1.5], [0.5, -0.25]], []),
    "decimal commas and tabs": ("0\t1,5\n0,5\t2", {"decimal": ","}, [[0.0, 1.5], [0.5, 2.0]], "assumed"),
    "lines above": ("Bench 3\nof May\nt [s],y [m]\n0,1\n1,2", {"skip_lines": 2}, [[0.0, 1.0], [1.0, 2.0]], []),
    "units in a row": ("t,y\n[ms],mm\n0,1\n1,2", {"units_row": True}, [[0.0, 1e-3], [1e-3, 2e-3]], []),
    "dropped": (
        "t [s],y [m]\n0,1\n1,\nNaN,3\n2,n/a\n3,4", {"missing": "drop"}, [[0.0, 1.0], [3.0, 4.0]],
        ["3 lines of 5 dropped, where a value is missing"],
    ),
    "interpolated": (
        "t [s],y [m]\n-1,\n0,1\n1,-\n3,4\n5,nan", {"missing": "interpolate"}, [[0.0, 1.0], [1.0, 2.0], [3.0, 4.0]],
        [
            "1 lines of 5 filled by interpolation, where a value is missing",
            "2 lines of 5 dropped at the ends, where a value is missing",
        ],
    ),
    "the first": (
        "t [s],y [m]\n0,1\n1,2\n1,3\n0.5,4\n2,5", {"repeats": "first"}, [[0.0, 1.0], [1.0, 2.0], [2.0, 5.0]],
        ["2 lines of 5 dropped, whose time is not after all before"],
    ),
    "the mean": (
        "t [s],y [m]\n0,1\n1,2\n1,3\n0.5,4", {"repeats": "mean"}, [[0.0, 1.0], [0.5, 4.0], [1.0, 2.5]],
        ["2 lines of 4 sorted by their time, with means of those that have the same"],
    ),
    "the mean of what is there": (
        "t [s],y [m]\n0,1\n1,\n1,3\n2,5\n2,7", {"repeats": "mean", "missing": "interpolate"},
        [[0.0, 1.0], [1.0, 3.0], [2.0, 6.0]],
        ["2 lines of 5 sorted by their time, with means of those that have the same"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", READ)
def test_what_a_bench_writes_is_read_as_it_is_said_to(file, what):
    text, keys, due, said = READ[what]
    rows, notes = read(file, text.encode(), **keys)
    assert rows == [pytest.approx(row) for row in due]
    if said == "assumed":
        said = ["column 1 has no unit: s is assumed", "column 2 has no unit: m is assumed"]
    assert notes == said


REFUSED = {
    "a decimal comma": ("t;y\n0;1,5\n1;2", {}, "line 2, column y: '1,5' is not a finite number; decimals have a point"),
    "a comma for both": (
        "0,1,5\n1,2,5",
        {"decimal": ","},
        "line 1: 1 column; there must be as many .* with ; or a tab",
    ),
    "a point for thousands": ("0;1.000,5\n1;2,5", {"decimal": ","}, r"line 1, column 2: '1\.000,5' is not a finite"),
    "nothing": ("t,y\n0,1\n1,", {}, 'line 3, column y: the value is missing; missing = "drop" leaves such lines out'),
    "no time": ("t,y\n0,1\n,2\n3,4", {"missing": "interpolate"}, "line 3, column t: the time is missing"),
    "a time again": ("0,1\n1,2\n1,3", {}, 'line 3: time 1 is not after .*; repeats = "first" leaves'),
    "a time again, below": ("0,1\n,2\n1,2\n1,3", {"missing": "drop"}, "line 4: time 1 is not after"),
    "too much is dropped": ("0,1\n1,\n2,", {"missing": "drop"}, "1 lines are left; there must be two at least"),
    "no units": ("0,1\n1,2", {"units_row": True}, "units_row: the first line must name the columns"),
    "all is skipped": ("0,1\n1,2", {"skip_lines": 9}, "0 lines with numbers"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_nothing_is_guessed(file, what):
    text, keys, said = REFUSED[what]
    with pytest.raises(ValueError, match=said):
        read(file, text.encode(), **keys)


def test_a_load_takes_the_same_keys(file):
    file.write_text("t [s];F [kN]\n0;1,5\n1;\n2;2,5\n")
    load = load_of(on="tip", signal="table", file=str(file), decimal=",", missing="drop")
    assert load.value([0.0, 1.0]).tolist() == [1500.0, 2000.0]
    assert load.notes == ["1 lines of 3 dropped, where a value is missing"]
