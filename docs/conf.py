"""Settings of `./build.sh docs`: the pages as a site that needs no network to be read."""

import re
from pathlib import Path

project = html_title = "springbeam"
extensions = ["myst_parser"]
html_theme = "furo"
root_doc = "README"
exclude_patterns = ["images"]
html_show_sphinx = False
# Headings can be linked to as on a code host; links out of this folder lead to the checkout, which has no pages.
myst_heading_anchors = 3
suppress_warnings = ["myst.xref_missing"]

#: Pages by the headings of the index, README.md.
PAGES: dict[str, list[str]] = {}
for heading, page in re.findall(
    r"^\| (?:\*\*(.+)\*\*|\[.*\]\((\w+)\.md\)) \|", Path(__file__).with_name("README.md").read_text("utf-8"), re.M
):
    if heading:
        PAGES[heading] = []
    else:
        PAGES[list(PAGES)[-1]].append(page)


def setup(app):
    """Give the site its contents, which a code host has no use for."""
    trees = "".join(
        f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n{chr(10).join(pages)}\n```\n"
        for caption, pages in PAGES.items()
    )

    def add(app, name, source):
        source[0] += trees if name == app.config.root_doc else ""

    app.connect("source-read", add)
