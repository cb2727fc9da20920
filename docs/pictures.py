"""Draws the pictures of README.md, commands.md and tutorial.md by the commands of these pages: python docs/pictures.py

It takes a minute or two, and draws the report by headless Chromium.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from pages import DOCS, IMAGES, shrink  # beside this script

#: Width and height of the picture of the report.
SIZE = (1000, 1160)
#: Moves the slider to a third of the run, where the tip is free.
SLIDE = """<script>addEventListener("load", () => {
  const slider = document.getElementById("slider");
  slider.value = Math.round(slider.max / 3);
  slider.dispatchEvent(new Event("input"));
});</script>"""


def command(line: str, folder: Path) -> None:
    words = line.split()[1:]
    subprocess.run([sys.executable, "-m", "springbeam", *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def report(page: Path) -> None:
    """Draw the upper part of a report."""
    page.write_text(page.read_text("utf-8").replace("</body>", f"{SLIDE}</body>"), "utf-8")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("no Chromium found")
    size = ",".join(map(str, SIZE))
    shot = ["--headless", "--no-sandbox", "--hide-scrollbars", "--virtual-time-budget=5000", f"--window-size={size}"]
    subprocess.run([chromium, *shot, f"--screenshot={IMAGES / 'report.png'}", page.as_uri()], check=True)


def main() -> None:
    sweep = re.search(r"^springbeam sweep bumper.toml .*$", (DOCS / "tutorial.md").read_text("utf-8"), re.M)
    assert sweep is not None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for line in ("run soft", "report results/soft", "new bumper", "run bumper.toml"):
            command(f"springbeam {line}", folder)
        command(sweep[0], folder)
        shutil.copy(folder / "results/soft/overview.png", IMAGES / "soft.png")
        shutil.copy(folder / "results/bumper/overview.png", IMAGES / "tutorial-overview.png")
        shutil.copy(folder / "designs/sweep.png", IMAGES / "tutorial-sweep.png")
        report(folder / "results/soft/report.html")
    for picture in ("soft", "tutorial-overview", "tutorial-sweep", "report"):
        shrink(IMAGES / f"{picture}.png")


if __name__ == "__main__":
    main()
