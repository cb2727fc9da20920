"""Bad inputs, a case of tests/bad_inputs.toml each: exit code 2, one message with place and remedy, nothing written."""

import json
import os
import re
import shutil
from copy import deepcopy
from pathlib import Path

import jsonschema
import pytest
import tomli_w
from commands import printed, refused

from springbeam.scene import load_scene, messages, scene_from_dict, shipped_scenes
from springbeam.scene.files import beginning, tomllib

TABLE = tomllib.loads(Path(__file__).parents[1].joinpath("bad_inputs.toml").read_text(encoding="utf-8"))
COMMANDS = TABLE["commands"]
SCENES = {f"{group}-{name}": case for group, cases in TABLE["scenes"].items() for name, case in cases.items()}
SCHEMA = jsonschema.Draft202012Validator(messages.schema())
#: What of a case is no change of the scene.
ABOUT = ("without", "place", "remedy")


def content_of(case):
    """Return the bytes of the scene file of a case."""
    if "bytes" in case:
        return (case["start"] + case["bytes"] * case["times"]).encode("latin-1")
    if "text" in case:
        return f"{case['text']}\n".encode()
    data = deepcopy(TABLE["base"])
    for name in case.get("without", []):
        table, _, key = name.partition(".")
        del (data[table] if key else data)[key or table]
    for table, change in case.items():
        if table not in ABOUT:
            both = isinstance(change, dict) and isinstance(data.get(table), dict)
            data[table] = data[table] | change if both else change
    return tomli_w.dumps(data).encode()


def listed(value):
    return value if isinstance(value, list) else [value]


def contents(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


@pytest.mark.parametrize("name", SCENES)
def test_a_bad_scene_is_refused(name, here):
    places = listed(SCENES[name]["place"])
    remedies = listed(SCENES[name]["remedy"])
    Path("scene.toml").write_bytes(content_of(SCENES[name]))
    before = contents(here)
    lines = refused("run", "scene.toml").removeprefix("error: ").splitlines()
    assert len(lines) == len(places)
    for line, place, remedy in zip(lines, places, remedies, strict=True):
        assert line.startswith(f"scene.toml: {place}")
        assert remedy in line
    assert contents(here) == before


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder in which no mistake leaves anything."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "comma.toml").write_text("[time]\nt_end = 0.6\n\n[spring]\nmass = 1,0\n")
    (folder / "empty").mkdir()
    (folder / "folder.toml").mkdir()
    (folder / "circle.toml").symlink_to("circle.toml")
    (folder / "nowhere.toml").symlink_to("missing.toml")
    os.mkfifo(folder / "pipe.toml")
    printed("run", "soft", "--no-plots", "--out", folder / "done")
    shutil.copytree(folder / "done", folder / "results" / "soft")
    return folder


@pytest.mark.parametrize("mistake", COMMANDS)
def test_a_bad_command_is_refused(desk, monkeypatch, mistake):
    monkeypatch.chdir(desk)
    line, *fragments = COMMANDS[mistake]
    before = {path.name for path in desk.rglob("*")}
    said = " ".join(re.sub("[│╭╮╰╯─]", " ", refused(*line.split())).split())
    for fragment in fragments:
        assert fragment in said
    assert len(re.findall(r"\berror\b", said, re.I)) == 1
    assert {path.name for path in desk.rglob("*")} == before


def test_a_byte_order_mark_does_no_harm(tmp_path):
    text = "[time]\nt_end = 1.0\n[spring]\nmass = 1.0\nlinear_stiffness = 3.0\n"
    (tmp_path / "marked.toml").write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    (tmp_path / "plain.toml").write_text(text)
    assert load_scene(tmp_path / "marked.toml") == load_scene(tmp_path / "plain.toml")


#: 50.0 is a whole number in JSON.
NOT_IN_SCHEMA = {"type-exponent-as-count", "type-float-as-count", "type-float-as-degree"}


@pytest.mark.parametrize("name", [n for n in SCENES if n.split("-")[0] in ("key", "table", "type", "range")])
def test_the_schema_refuses_it_too(name):
    tables = tomllib.loads(content_of(SCENES[name]).decode())
    assert SCHEMA.is_valid(json.loads(json.dumps(tables, default=str))) == (name in NOT_IN_SCHEMA)


def test_the_schema_accepts_the_scenes_that_are_shipped_and_begun():
    SCHEMA.check_schema(SCHEMA.schema)
    shipped = [path.read_text(encoding="utf-8") for path in shipped_scenes().values()]
    for text in [beginning('a "scene"'), *shipped]:
        SCHEMA.validate(tomllib.loads(text))
        scene_from_dict(tomllib.loads(text))
