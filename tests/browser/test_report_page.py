"""The report in headless Chromium: it loads by itself, the slider moves the bodies to where the run has them.

`./build.sh browser` installs what is needed; without it these tests are skipped, with the reason.
"""

import json
import os
import shutil

import numpy as np
import pytest
from commands import HANGS, printed

from springbeam.results.directory import REPORT
from springbeam.results.files import load_trajectory
from springbeam.scene import shipped_scenes

DESKTOP = {"width": 1200, "height": 900}
PHONE = {"width": 390, "height": 800}
#: Shorter where nothing new happens later.
T_END = {"soft": 0.3, "duffing": 4.0, "bar-impact": 2.2}


@pytest.fixture(scope="session")
def browser():
    remedy = "./build.sh browser installs what these tests need"
    playwright = pytest.importorskip("playwright.sync_api", reason=f"playwright is not installed; {remedy}")
    names = (os.environ.get("CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome")
    chromium = next((found for name in names if name and (found := shutil.which(name))), None)
    if chromium is None:
        pytest.skip(f"no Chromium found; {remedy}")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def folder(tmp_path_factory, fmu_folder):
    return tmp_path_factory.mktemp("runs")


def run_and_report(folder, scene):
    """The directory of a run of ``scene`` with its report; made once."""
    directory = folder / scene
    if not directory.exists():
        shorter = ["--set", f"time.t_end={T_END[scene]}"] if scene in T_END else []
        printed("run", scene, "--out", directory, "--no-plots", *shorter)
        printed("report", directory)
    return directory


class Shown:
    """A report in a page of the browser, with everything it asked for and complained of."""

    def __init__(self, browser, directory, size=DESKTOP, **device):
        self.trajectory = load_trajectory(directory)
        self.url = (directory / REPORT).as_uri()
        self.page = browser.new_page(viewport=size, **device)
        self.page.set_default_timeout(1e3 * HANGS)
        self.requests = []
        self.complaints = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.goto(self.url)
        self.data = json.loads(self.page.locator("#data").inner_text())

    def path(self, part):
        """The path that is drawn of a part of the motion."""
        index = self.data["motion"]["parts"]["motion"]["traces"].index(part)
        return str(self.page.locator("#motion .scatterlayer .js-line").nth(index).get_attribute("d"))

    def height_of_end(self, part):
        """Where a part's path ends [m], from its pixels and the axis."""
        pixel = float(self.path(part).replace("L", " ").replace("M", " ").split()[-1].split(",")[1])
        low, high, length = self.page.evaluate(
            "() => { const a = document.getElementById('motion')._fullLayout.yaxis; return [...a.range, a._length]; }"
        )
        return float((high + (low - high) * pixel / length) / self.data["motion"]["parts"]["motion"]["factor"])

    def set_slider(self, frame):
        self.page.locator("#slider").fill(str(frame))

    def frame(self):
        return int(self.page.locator("#slider").input_value())


@pytest.fixture
def soft(browser, folder):
    shown = Shown(browser, run_and_report(folder, "soft"))
    yield shown
    assert shown.complaints == []
    shown.page.close()


@pytest.mark.parametrize("scene", shipped_scenes())
def test_every_shipped_scene_loads_alone_and_moves(browser, folder, scene):
    shown = Shown(browser, run_and_report(folder, scene))
    frames = len(shown.data["motion"]["time"])
    for part in shown.data["motion"]["parts"]["motion"]["traces"]:
        drawn = set()
        for frame in (0, frames // 7, frames // 3):
            shown.set_slider(frame)
            drawn.add(shown.path(part))
        # A bar held by its stop and a spring that nothing meets rest now and then, never in all three; a beam that
        # hardly moves beside the spring is in a chart of its own.
        assert len(drawn) > 1 or (part == "beam" and "positions-enlarged" in shown.data["overTime"])
    for name in shown.data["overTime"]:
        assert shown.page.locator(f"#{name} .main-svg").count() > 0
    assert shown.requests == [shown.url]
    assert shown.complaints == []
    not_resolved = "not resolved" in shown.page.locator("main").inner_text()
    assert not_resolved == any("not resolved" in warning for warning in shown.trajectory.summary["warnings"])
    shown.page.set_viewport_size(PHONE)
    shown.page.wait_for_function(f"document.documentElement.scrollWidth === {PHONE['width']}")
    shown.page.close()


#: The charts whose buttons, or the controls of the motion, lie over a key or over the words of an axis.
COVERED = """() => [...document.querySelectorAll(".chart")].filter(chart => {
  const over = [chart.querySelector(".modebar"), document.getElementById("controls")];
  const words = [...chart.querySelectorAll(".legend, .xtitle")];
  return over.some(one => words.some(other => {
    const a = one.getBoundingClientRect(), b = other.getBoundingClientRect();
    return a.width > 0 && a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  }));
}).map(chart => chart.id)"""


@pytest.mark.parametrize("size", [{"width": 1440, "height": 900}, {"width": 390, "height": 844}], ids=str)
@pytest.mark.parametrize("scene", ["soft", "paper-fig2", "vibro-impact"])
def test_the_slider_is_in_sight_at_once_also_below_warnings_and_nothing_covers_words(browser, folder, scene, size):
    shown = Shown(browser, run_and_report(folder, scene), size)
    box = shown.page.locator("#slider").bounding_box()
    assert 0.0 <= box["y"] <= size["height"] - box["height"]
    assert shown.page.evaluate(COVERED) == []
    shown.page.close()


#: Whether a chart keeps a touch for itself, so that the page does not scroll.
KEPT = """() => {
  const target = document.querySelector("#positions .nsewdrag"), at = target.getBoundingClientRect();
  const touches = [new Touch({ identifier: 1, target, clientX: at.left + 50, clientY: at.top + 50 })];
  const lists = { touches, targetTouches: touches, changedTouches: touches };
  const touch = new TouchEvent("touchstart", { ...lists, bubbles: true, cancelable: true });
  return !target.dispatchEvent(touch);
}"""


def test_a_finger_on_a_chart_scrolls_the_page_of_a_phone(browser, folder):
    shown = Shown(browser, run_and_report(folder, "soft"), PHONE, has_touch=True, is_mobile=True)
    assert not shown.page.evaluate(KEPT)
    shown.page.evaluate("Plotly.relayout('positions', { dragmode: 'zoom' })")
    assert shown.page.evaluate(KEPT)
    shown.page.close()


def test_bodies_are_drawn_where_the_run_has_them(soft):
    times, shapes = soft.trajectory.shapes
    before = soft.path("beam")
    for frame in (10, 200, len(times) - 1):
        soft.set_slider(frame)
        assert soft.path("beam") != before
        row = int(np.searchsorted(soft.trajectory.time, times[frame], side="right")) - 1
        # Paths are written with hundredths of a pixel, here 0.4 mm high.
        assert soft.height_of_end("beam") == pytest.approx(shapes[frame, -1], abs=5e-6)
        assert soft.height_of_end("coil") == pytest.approx(soft.trajectory.y[row], abs=5e-6)
        reading = " ".join(soft.page.locator("#reading").inner_text().split())
        assert f"t = {times[frame]:#.6g} s" in reading
        assert str(soft.trajectory.phase[row]) in reading


def test_play_ends_with_the_run(soft):
    last = len(soft.data["motion"]["time"]) - 1
    soft.set_slider(last - 3)
    soft.page.locator("#play").click()
    soft.page.wait_for_function(f"document.getElementById('slider').value === '{last}'")
    soft.page.wait_for_function("document.getElementById('play').getAttribute('aria-label') === 'Play'")


def test_zooming_one_time_axis_zooms_all(soft):
    ranges = "() => [...document.querySelectorAll('#over-time .chart')].map(c => c.layout.xaxis.range)"
    assert len({tuple(r) for r in soft.page.evaluate(ranges)}) == 1
    soft.page.evaluate("Plotly.relayout('gap', {'xaxis.range': [0.05, 0.1]})")
    soft.page.wait_for_function(f"({ranges})().every(r => r[0] === 0.05 && r[1] === 0.1)")
    soft.page.evaluate("Plotly.relayout('forces', {'xaxis.autorange': true})")
    soft.page.wait_for_function(f"({ranges})().every(r => r[0] === 0 && r[1] === 0.3)")
