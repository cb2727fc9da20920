"""Settings of `./build.sh docs`: the pages as a site that needs no network to be read."""

project = html_title = "springbeam"
extensions = ["myst_parser"]
html_theme = "furo"
root_doc = "README"
exclude_patterns = ["images"]
html_show_sphinx = False
# Headings can be linked to as on a code host; links out of this folder lead to the checkout, which has no pages.
myst_heading_anchors = 3
suppress_warnings = ["myst.xref_missing"]

PAGES = {
    "How to": "tutorial contact accuracy report loads sweeps signals scripting own_fmu tools faq",
    "Reference": "scene commands files api fmu_variables glossary",
    "Theory and measurements": "model coupling stability measured performance paper",
    "Development": "architecture contributing notebook",
}


def setup(app):
    """Give the site its contents, which a code host has no use for."""
    trees = "".join(
        f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n{chr(10).join(pages.split())}\n```\n"
        for caption, pages in PAGES.items()
    )

    def add(app, name, source):
        source[0] += trees if name == app.config.root_doc else ""

    app.connect("source-read", add)
