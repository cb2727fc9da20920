"""Bad inputs: exit code 2, one error for each fault with its place and a remedy, nothing written.

Of every key every kind of fault, made from the schema; conditions on several keys, files that are no scenes and
commands from tests/bad_inputs.toml.
"""

import json
import math
import os
import re
import shutil
from pathlib import Path

import jsonschema
import pytest
import tomli_w
from commands import printed, refused
from scenes import table

from springbeam.scene import load_scene, messages, scene_from_dict, shipped_scenes
from springbeam.scene.files import beginning, tomllib

TABLE = table("bad_inputs.toml")
BASE = TABLE["base"]
COMMANDS = TABLE["commands"]
SCENES = {f"{group}-{name}": case for group, cases in TABLE["scenes"].items() for name, case in cases.items()}
SCHEMA = jsonschema.Draft202012Validator(messages.schema())
#: What of a case is no change of the scene.
ABOUT = ("without", "place", "remedy")
#: What a user is asked to do, or what would be right.
REMEDY = re.compile(
    r"\b(use|leave|give|must|allowed|put|check|check the units|a line is|acts on|is for|needs|can hold)\b"
)
#: A mass, a modulus, an area … of nothing is none.
POSITIVE = {"kg", "kg/m³", "m²", "m⁴", "Pa", "Hz"}
#: Values of every type, small and large; those that are not finite are no JSON.
VALUES = ("some", -1, 0, 2.5, 10**9, True, [], [[1.0]], {"value": [1.0]})
NOT_FINITE = (math.nan, math.inf, -math.inf)
BOUNDS = ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")


def listed(value):
    return value if isinstance(value, list) else [value]


def contents(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


def errors(content):
    """Return the lines that ``springbeam run`` says of a scene file of these bytes; it must write nothing."""
    Path("scene.toml").write_bytes(content)
    before = contents(Path())
    lines = refused("run", "scene.toml").removeprefix("error: ").splitlines()
    assert contents(Path()) == before
    return lines


# -- one key


def valid(key):
    """Return a value that a key of the schema may have."""
    candidates = (*key.get("enum", ()), key.get("const"), 1, 1e-3, "some", {})
    return next(value for value in candidates if value is not None and SCHEMA.evolve(schema=key).is_valid(value))


def invalid(key):
    """Return values that a key of the schema may not have: of other types, and beyond each bound or on it."""
    limits = [key[bound] for bound in BOUNDS if bound in key]
    candidates = [*VALUES, *(limit + change for limit in limits for change in (-1, 0, 1))]
    allowed = key.get("enum", ())  # 1 is true
    wrong = [value for value in candidates if value not in allowed and not SCHEMA.evolve(schema=key).is_valid(value)]
    return [*wrong, *NOT_FINITE, *[0.0] * (key["unit"] in POSITIVE)]


def tables():
    """Yield the name of each table of a scene, its kind, its keys, those that are needed, and its class."""
    for name in ("", "time", "beam", "spring", "stop", "contact", "coupling", "loads"):
        for kind, model in messages.models_of(name).items():
            keys = {key: said for key, said in messages.keys_of(model).items() if "unit" in said}
            right = {key: valid(said) for key, said in keys.items() if model.model_fields[key].is_required()}
            if "const" in keys.get(choice := getattr(messages.VARIANTS.get(name), "name", ""), ()):
                right[choice] = kind
            yield pytest.param(name, keys, right, model, id=f"{name}-{kind}")


@pytest.mark.parametrize(("name", "keys", "right", "model"), list(tables()))
def test_every_key_with_every_kind_of_fault(name, keys, right, model, here):
    heading = {"": "", "loads": "[loads.0] "}.get(name, f"[{name}] ")

    def refuse(content, key, *what):
        scene = BASE | ({name: [content] if name == "loads" else content} if name else content)
        (line,) = errors(tomli_w.dumps(scene).encode())
        place = f"scene.toml: {heading}{key}"
        assert line.startswith(place)
        for words in what:
            assert words in line.removeprefix(place)

    for key, said in keys.items():
        together = [group for ways in model.WAYS for group in ways if key in group]
        content = {other: value for other, value in right.items() if other not in model.other_ways(key)}
        content |= {other: valid(keys[other]) for group in together for other in group}
        refuse({**content, f"{key}_": 1.0}, f"{key}_", "unknown key; ", "allowed: ")
        if "const" in said:  # another value is another table
            continue
        limits = [f"{said[bound]:.15g}" for bound in BOUNDS if bound in said]
        for value in invalid(said):
            refuse({**content, key: value}, key, " = ", "must be ", *limits, *map(json.dumps, said.get("enum", ())))
        if key in right and key != "fmu":  # without it the body is our own
            refuse({other: value for other, value in content.items() if other != key}, key, ": missing; ", "give ")


# -- tables, conditions on several keys, files


def content_of(case):
    """Return the bytes of the scene file of a case."""
    if "bytes" in case:
        return (case["start"] + case["bytes"] * case["times"]).encode("latin-1")
    if "text" in case:
        return f"{case['text']}\n".encode()
    gone = case.get("without", [])
    data = {name: content for name, content in BASE.items() if name not in gone}
    for name in data:
        data[name] = {key: value for key, value in data[name].items() if f"{name}.{key}" not in gone}
    for name, change in case.items():
        if name not in ABOUT:
            both = isinstance(change, dict) and isinstance(data.get(name), dict)
            data[name] = data[name] | change if both else change
    return tomli_w.dumps(data).encode()


@pytest.mark.parametrize("name", BASE)
def test_a_table_that_is_none(name, here):
    for value in ("text", 3, True, [1, 2], [{"key": 1.0}, {"key": 2.0}]):
        (line,) = errors(tomli_w.dumps({**BASE, name: value}).encode())
        assert line.startswith(f"scene.toml: {name} = ")
        assert line.endswith("must be a table, written as [name] above its keys")
    lines = errors(tomli_w.dumps({**BASE, f"{name}s": BASE[name]}).encode())
    assert lines[0].startswith(f"scene.toml: {name}s: unknown key; did you mean {name}? allowed: ")


@pytest.mark.parametrize("name", SCENES)
def test_a_bad_scene_is_refused(name, here):
    places = listed(SCENES[name]["place"])
    remedies = listed(SCENES[name].get("remedy", [""] * len(places)))
    for line, place, remedy in zip(errors(content_of(SCENES[name])), places, remedies, strict=True):
        assert line.startswith(f"scene.toml: {place}")
        assert remedy in line
        assert REMEDY.search(line)


# -- commands


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder in which no mistake leaves anything."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "comma.toml").write_text("[time]\nt_end = 0.6\n\n[spring]\nmass = 1,0\n")
    spring = {"fmu": "a.fmu", "force": "F", "displacement": "x"}
    (folder / "fmu.toml").write_text(tomli_w.dumps({"time": {"t_end": 1.0}, "spring": spring}))
    rows = "".join(f"{0.1 * k:g} {k % 7} {k % 5}\n" for k in range(400))
    (folder / "record.dat").write_text(f"# time [ms] table [g] dut [mV]\n{rows}")
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


def test_the_schema_accepts_the_scenes_that_are_shipped_and_begun():
    SCHEMA.check_schema(SCHEMA.schema)
    shipped = [path.read_text(encoding="utf-8") for path in shipped_scenes().values()]
    for text in [beginning('a "scene"'), *shipped]:
        SCHEMA.validate(tomllib.loads(text))
        scene_from_dict(tomllib.loads(text))
