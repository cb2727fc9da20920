"""The report: one valid page that needs nothing else, holds the run's own numbers, and says what is wrong with them."""

import base64
import dataclasses
import json
import re
from collections import Counter

import numpy as np
import plotly.graph_objects as go
import pytest
from lxml import html
from runs import EVERY_EVENT, PAIR, SCENES, a_trajectory

from springbeam.pictures.panels import panels
from springbeam.pictures.report import page
from springbeam.results.trajectory import BODY_COLUMNS
from springbeam.scene import scene_from_dict, with_changes
from springbeam.scene.files import tomllib

VOID = {"meta", "input", "br", "link", "img", "hr"}


class Page:
    """A page by the ids of its elements, all of which are closed."""

    def __init__(self, text):
        bare = re.sub(r"<(script|style)\b.*?</\1>", "", text, flags=re.S)
        opened, closed = (Counter(re.findall(tag, bare)) for tag in (r"<(\w+)(?:[^<>]*[^<>/])?>", r"</(\w+)>"))
        assert {tag: n for tag, n in opened.items() if tag not in VOID} == closed
        self.root = html.document_fromstring(text)
        self.ids = self.root.xpath("//@id")

    def __getitem__(self, name):
        """Return the text of an element, in words."""
        return " ".join(self.root.get_element_by_id(name).text_content().split())

    @property
    def data(self):
        return json.loads(self.root.get_element_by_id("data").text)


def shown(run=None, **summary):
    """Return the page of a run, or of a made-up one with this summary."""
    return Page(page(dataclasses.replace(a_trajectory(), summary=summary) if run is None else run))


def array(spec):
    """What plotly's JSON has for an array."""
    if isinstance(spec, dict):
        values = np.frombuffer(base64.b64decode(spec["bdata"]), dtype=spec["dtype"])
        return values.reshape([int(n) for n in str(spec.get("shape", values.size)).split(",")])
    return np.array(spec)


def curves(data):
    """Curves over time by the column they show."""
    return {
        curve["meta"]: curve for name in data["overTime"] for curve in data["charts"][name]["data"] if "meta" in curve
    }


CHARTS = {
    "all": {"positions", "velocities", "forces", "impulses", "gap", "energies", "residual", "timeline"},
    "no spring": {"positions", "velocities", "forces", "gap", "impulses"},
    "spring": {"positions", "velocities", "energies", "residual"},
}


# -- the page -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("has", CHARTS)
def test_every_scene_has_one_valid_page_that_loads_nothing(has):
    scene = SCENES[has]
    found = shown(a_trajectory(scene, events=EVERY_EVENT))
    assert len(found.ids) == len(set(found.ids))
    loaded = found.root.xpath("//@src | //@href | //@srcset | //@poster | //@action | //@formaction | //@background")
    assert all(address.startswith("data:") for address in loaded)
    assert found.root.xpath("//link") == []
    assert not re.search(r"@import|url\(", found.root.xpath("string(//style)"))
    assert CHARTS[has] | {"motion", "slider", "play", "numbers", "scene", "reproduce", "about"} <= set(found.ids)
    data = found.data
    assert {*data["motion"]["parts"], *data["overTime"]} == set(data["charts"]) <= set(found.ids)
    for chart in data["charts"].values():
        go.Figure(chart)  # knows all keys and values of plotly.js, and raises ValueError for others
    absent = {"u_tip": scene.beam, "y": scene.spring, "foundation_force": scene.stop}
    assert not [name for name, body in absent.items() if body is None and name in curves(data)]


# -- its numbers --------------------------------------------------------------------------------------------------


def test_curves_are_the_columns_bit_for_bit_in_single_precision():
    run = a_trajectory(events=EVERY_EVENT)
    found = curves(shown(run).data)
    drawn = [(panel, curve) for panel in panels(run) for curve in panel.curves]
    for panel, curve in drawn:
        assert ("stackgroup" in found[curve.name]) == curve.stacked
        if curve.name in run.columns and curve.name != "energy_residual":
            of = run.without_start() if curve.name in BODY_COLUMNS else run
            for axis, values in (("x", of.time), ("y", panel.unit.factor * of[curve.name])):
                drawn_values = array(found[curve.name][axis])
                assert np.array_equal(drawn_values, values.astype(drawn_values.dtype))
    assert {curve.name for _, curve in drawn} >= {
        "u_tip", "y", "v_tip", "z", "contact_force", "foundation_force", "gap", "e_total"
    }  # fmt: skip


# -- how to run it again ------------------------------------------------------------------------------------------


def test_the_scene_as_run_is_on_the_page():
    """Its title is text, not markup."""
    own = with_changes(PAIR, stop=None).model_copy(update={"title": "</script><script>alert(1)</script>"})
    found = shown(a_trajectory(own))
    assert found.root.xpath("string(//h1)").strip() == own.title
    assert not any("alert(1)" in script.text for script in found.root.xpath("//script"))
    assert "springbeam run scene.toml" in found["reproduce"]
    text = found.root.get_element_by_id("scene").text_content().split("Scene as run")[1]
    assert scene_from_dict(tomllib.loads(text)) == own
