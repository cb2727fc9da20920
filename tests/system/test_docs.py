"""The documentation's programs run, and its tables are what the FMUs say."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def blocks(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), re.M | re.S)


@pytest.mark.parametrize(
    ("page", "number", "expected"),
    [
        ("scripting.md", 0, r"mass 1\.0 kg: first impact on the foundation at 0\.07\d+ s"),
        ("scripting.md", 1, r"largest difference of y: \d\.\de-1[0-4] m\nenergy residual: \d\.\de-1[0-9]"),
        ("scripting.md", 2, r"energy residual \d\.\de-1[0-9]"),
        ("tools.md", 0, r"y\(1\.0 s\) = -?0\.\d+ m"),
    ],
)
def test_a_program_of_the_documentation_runs(page, number, expected, capsys, monkeypatch):
    monkeypatch.chdir(DOCS.parent)
    exec(compile(blocks(page)[number], f"{page}[{number}]", "exec"), {"__name__": "__main__"})
    assert re.search(expected, capsys.readouterr().out)


def test_all_programs_are_tested():
    assert [len(blocks(page)) for page in ("scripting.md", "tools.md")] == [3, 1]


def test_the_table_of_variables_is_current():
    specification = importlib.util.spec_from_file_location("fmu_variables", DOCS / "fmu_variables.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    assert (DOCS / "fmu_variables.md").read_text(encoding="utf-8") == module.page(), "run python docs/fmu_variables.py"


def test_links_between_pages_lead_somewhere():
    for page in [*DOCS.glob("*.md"), DOCS.parent / "README.md"]:
        for target, anchor in re.findall(
            r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)", page.read_text(encoding="utf-8")
        ):
            file = (page.parent / target) if target else page
            assert file.exists(), f"{page.name}: {target}"
            if anchor and file.suffix == ".md":
                titles = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.M)
                slugs = [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles]
                assert anchor in slugs, f"{page.name}: {target}#{anchor}"
