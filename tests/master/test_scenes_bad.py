"""Scene files that cannot be run: each is refused with its message, and leaves nothing behind."""

import json
import os
import re
from copy import deepcopy
from pathlib import Path

import jsonschema
import pytest
import tomli_w
from commands import refused

from springbeam.scene import load_scene, messages, scene_from_dict, shipped_scenes
from springbeam.scene.reading import tomllib

GROUPS = tomllib.loads(Path(__file__).with_name("scenes_bad.toml").read_text(encoding="utf-8"))
BASE = GROUPS.pop("base")
SCHEMA = jsonschema.Draft202012Validator(messages.schema())
#: How each message about syntax ends.
TOML_IS = "; a line is a [table] or key = value, with numbers like 0.5 or 1e-3 and texts in quotes"
CASES = {f"{group}-{name}": case for group, cases in GROUPS.items() for name, case in cases.items()}


def text_of(case):
    """The scene file of a case."""
    if "text" in case:
        return f"{case['text']}\n"
    data = deepcopy(BASE)
    for name in case.get("without", []):
        table, _, key = name.partition(".")
        del (data[table] if key else data)[key or table]
    for table, change in case.items():
        if table not in ("without", "error"):
            both = isinstance(change, dict) and isinstance(data.get(table), dict)
            data[table] = data[table] | change if both else change
    return tomli_w.dumps(data)


def check(path, expected, here, monkeypatch):
    monkeypatch.chdir(here)
    before = sorted(here.rglob("*"))
    said = refused("run", path)
    lines = said.removeprefix("error: ").splitlines()
    assert len(lines) == len(expected), said
    for line, wanted in zip(lines, expected, strict=True):
        pattern = ".*".join(map(re.escape, f"{path}: {wanted}".split("…")))
        assert re.fullmatch(pattern, line), said
    assert sorted(here.rglob("*")) == before


@pytest.mark.parametrize("name", CASES)
def test_refused_with_its_message(name, tmp_path, monkeypatch):
    expected = CASES[name]["error"]
    if name.startswith("syntax-"):
        expected += TOML_IS
    path = tmp_path / "scene.toml"
    path.write_text(text_of(CASES[name]), encoding="utf-8")
    check(path, expected if isinstance(expected, list) else [expected], tmp_path, monkeypatch)


NO_TIME = "time: missing; give a table, written as [name] above its keys"
GOOD = "[time]\nt_end = 1.0\n[spring]\nmass = 1.0\nlinear_stiffness = 3.0\n"
NOT_UTF8 = "cannot be read as TOML: 'utf-8' codec can't decode … in position {}: …"
BYTES = {
    "empty": (b"", NO_TIME),
    "blank": (b" \n\t\n", NO_TIME),
    "byte order mark": (b"\xef\xbb\xbf", NO_TIME),
    "UTF-16": (GOOD.encode("utf-16"), NOT_UTF8.format(0)),
    "UTF-16 without a mark": (GOOD.encode("utf-16-be"), "cannot be read as TOML: … (at line 1, column 1)…"),
    "Latin-1": ('title = "Stoß"\n'.encode("latin-1"), NOT_UTF8.format(12)),
    "a picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", NOT_UTF8.format(0)),
    "an archive": (b"PK\x03\x04\x14\0\0\0\x08\0", "cannot be read as TOML: …"),
    "a program": (b"\x7fELF\x02\x01\x01" + bytes(9), "cannot be read as TOML: … (at line 1, column 1)…"),
    "zeros": (bytes(100), "cannot be read as TOML: … (at line 1, column 1)…"),
    "a zero in a text": (b'title = "a\0b"\n', "cannot be read as TOML: …"),
    "escape sequences": (b"\x1b[31mred\x1b[0m\n", "cannot be read as TOML: …"),
    "surrogate": (b'title = "\xed\xa0\x80"\n', NOT_UTF8.format(9)),
    "escaped surrogate": (b'title = "\\ud800"\n', "cannot be read as TOML: …"),
    "nested lists": (b"a = " + b"[" * 100_000, "cannot be read as TOML: maximum recursion depth exceeded…"),
    "nested tables": (b"a = " + b"{a = " * 50_000, "cannot be read as TOML: maximum recursion depth exceeded…"),
    "a value nested deeply": (
        GOOD.encode() + b"damping = " + b"[" * 150 + b"]" * 150,
        "[spring] damping = [[…: must be a finite number at least 0",
    ),
    "a dotted key of many parts": (GOOD.encode() + b".".join([b"a"] * 300) + b" = 1", "[spring] a: unknown key; …"),
    "a long key": (GOOD.encode() + b"k" * 5000 + b" = 1", f"[spring] {'k' * 50}…: unknown key; allowed: …"),
    "a long line": (GOOD.encode() + b"damping = " + b"x" * 5000, "cannot be read as TOML: … (at line 6, column 11)…"),
    "a huge integer": (
        b"[time]\nt_end = 1" + b"0" * 400,
        f"[time] t_end = 1{'0' * 58}…: must be a finite number greater than 0",
    ),
    "a huge hexadecimal": (
        b"[time]\nt_end = 0x" + b"f" * 2000,
        f"[time] t_end = {str(16**2000 - 1)[:59]}…: must be a finite number greater than 0",
    ),
    "more digits than Python reads": (
        b"[time]\nt_end = " + b"9" * 5000,
        "cannot be read as TOML: Exceeds the limit (4300 digits)…",
    ),
    "a long text": (
        GOOD.encode() + b'damping = "' + b"9" * 500 + b'"',
        f'[spring] damping = "{"9" * 58}…: must be a finite number at least 0',
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BYTES)
def test_whatever_bytes_are_in_it(name, tmp_path, monkeypatch):
    content, expected = BYTES[name]
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    check(path, [expected], tmp_path, monkeypatch)


def test_a_byte_order_mark_does_no_harm(tmp_path):
    (tmp_path / "marked.toml").write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    (tmp_path / "plain.toml").write_text(GOOD)
    assert load_scene(tmp_path / "marked.toml") == load_scene(tmp_path / "plain.toml")


@pytest.mark.skipif(os.name == "nt", reason="POSIX files")
def test_what_is_no_file(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "circle.toml").symlink_to("circle.toml")
    (tmp_path / "nowhere.toml").symlink_to("missing.toml")
    for name, what in {
        "pipe.toml": "no such file",
        "folder.toml": "is a directory",
        "circle.toml": "no such file",
        "nowhere.toml": "no such file",
        "missing.toml": "no such file",
        "soft.toml": "no such file, and no shipped scene; did you mean soft?",
        "sotf": "no such file, and no shipped scene; did you mean soft?",
        "/dev/zero": "no such file",
    }.items():
        check(name, [f"{what}…shipped scenes: …"], tmp_path, monkeypatch)
    assert refused("run", "x" * 300 + ".toml").startswith(f"error: {'x' * 59}…: no such file")


#: 50.0 is a whole number in JSON.
NOT_IN_SCHEMA = {"type-exponent-as-count", "type-float-as-count", "type-float-as-degree"}


@pytest.mark.parametrize("name", [n for n in CASES if n.split("-")[0] in ("key", "table", "type", "range")])
def test_the_schema_refuses_it_too(name):
    accepted = SCHEMA.is_valid(json.loads(json.dumps(tomllib.loads(text_of(CASES[name])), default=str)))
    assert accepted == (name in NOT_IN_SCHEMA)


def test_the_schema_accepts_the_scenes_that_are_shipped_and_begun():
    SCHEMA.check_schema(SCHEMA.schema)
    texts = [
        messages.beginning('a "scene"'),
        *(path.read_text(encoding="utf-8") for path in shipped_scenes().values()),
    ]
    for text in texts:
        SCHEMA.validate(tomllib.loads(text))
        scene_from_dict(tomllib.loads(text))
