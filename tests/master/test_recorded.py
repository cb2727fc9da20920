"""Files of measured columns: what is read of them, what is refused, and what is said of it."""

import re
from pathlib import Path

import numpy as np
import pytest
from scenes import load_of

from springbeam.scene.files import tomllib
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


TABLE = tomllib.loads(Path(__file__).with_name("recorded.toml").read_text(encoding="utf-8"))
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


def test_a_load_takes_the_same_keys(file):
    file.write_text("t [s];F [kN]\n0;1,5\n1;\n2;2,5\n")
    load = load_of(on="tip", signal="table", file=str(file), decimal=",", missing="drop")
    assert load.value([0.0, 1.0]).tolist() == [1500.0, 2000.0]
    assert load.notes == ["1 lines of 3 dropped, where a value is missing"]
