"""The documentation is followed literally: programs and commands run, links lead somewhere, made pages are current."""

import importlib.util
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import COMMAND, HANGS, command

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    *sorted(DOCS.glob("*.md")),
    *sorted(ROOT.glob("src_*/README.md")),
    ROOT / "master/springbeam/paper/README.md",
]

#: What each program prints, as a regular expression, by page and number of the block.
PROGRAMS = {
    ("README.md", 0): r"deepest tip -0\.015000 m, energy residual \d\.\de-1[0-9]\n0\.000000000 s  impact",
    ("api.md", 0): r"contact_impulse    0\.9873\ncontact_force_max  9\.97\d?\ncontact_duration   0\.1444\n.*\n\[-0\.00",
    ("api.md", 1): r"^0\.1 tied \[-0\.00874",
    ("api.md", 2): r"^11\.4\d+ N, energy residual \d\.\de-1[0-9]",
    ("api.md", 3): r"^[1-9]\d* impacts?, energy residual \d\.\de-1[0-9]",
    ("tools.md", 0): r"y\(1\.0 s\) = -0\.075\d+ m",
    ("tools.md", 1): r"^y = -0\.0\d+ m",
    ("tools.md", 2): r"^y = 0\.0193\d+ m",
    ("tools.md", 3): r"^t = 0\.100167 s: -0\.99\d+ m/s, then 0\.49\d+ m/s$",
    ("tools.md", 4): r"u = -0\.010876 m, load_work 0\.010088 J, energy - load_work -?\de-1[67] J",
}
#: Lines of shell blocks that are not run here, and why.
NOT_RUN = {
    "./build.sh run": "is what made the FMUs that are tested",
    "./build.sh test": "is what runs this",
    "./build.sh bench": "measures for minutes",
    "SPRINGBEAM_STEPS=1000000": "takes minutes; test_long.py makes fewer steps",
    ".venv/bin/python docs/accuracy.py": "takes minutes",
    ".venv/bin/python docs/paper.py": "takes minutes",
    "./build.sh campaign": "takes minutes; test_accuracy.py judges a scene with it, test_stability.py extreme ones",
    "springbeam animate results/soft": "draws for half a minute; the command is in test_animation.py",
    "springbeam sweep vibro-impact": "takes a minute; the command is in test_sweep.py",
    "springbeam sweep pulse": "takes some seconds; what it asks for is in test_signals.py",
    "springbeam sweep soft": "starts a process for each core; the command is in test_command_line.py",
    "springbeam sweep bumper.toml": "takes half a minute; the command is in test_sweep.py",
}


def module(name):
    """A script of the folder of the pages."""
    specification = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    loaded = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(loaded)
    return loaded


@pytest.mark.parametrize("name", sorted(path.stem for path in DOCS.glob("*.py")))
def test_a_program_that_writes_tables_can_be_started(name, monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    assert module(name).__doc__


def test_every_page_is_in_the_index():
    conf = module("conf")
    named = [name for pages in conf.PAGES.values() for name in pages]
    assert sorted([*named, conf.root_doc]) == sorted(page.stem for page in DOCS.glob("*.md"))


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)


def shell_lines():
    return [line for page in PAGES for block in blocks(page, "sh") for line in block.splitlines()]


def reason_not_to_run(line):
    return next((reason for start, reason in NOT_RUN.items() if line.startswith(start)), None)


def shell_pages():
    return [page for page in PAGES if not all(map(reason_not_to_run, "\n".join(blocks(page, "sh")).splitlines()))]


@pytest.mark.parametrize(("page", "number"), PROGRAMS)
def test_a_program_of_the_documentation_runs(page, number, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = ROOT / page if page == "README.md" else DOCS / page
    exec(compile(blocks(path, "python")[number], f"{page}[{number}]", "exec"), {"__name__": "__main__"})
    assert re.search(PROGRAMS[page, number], capsys.readouterr().out, re.M)


def test_the_notebook_runs(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    names = {"__name__": "__main__"}
    for cell in json.loads((DOCS / "first_steps.ipynb").read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec(compile("".join(cell["source"]), "first_steps.ipynb", "exec"), names)
    run = names["run"]
    table = run.to_pandas()
    dataset = run.to_xarray()
    assert list(table.columns) == list(run.columns)
    assert np.array_equal(table["y"].to_numpy(), run.y)
    assert (table.attrs["units"]["z"], dataset["u_tip"].attrs) == ("m/s", {"units": "m"})
    assert np.array_equal(dataset["deflection"].sel(x=1.0).values, run.shapes[1][:, -1])
    for name in ("bending_moment", "shear_force"):
        assert np.array_equal(dataset[name].values, getattr(run, name))
    assert re.search(r"deepest tip -15\.00 mm\n0\.000000 s  impact\n(.*\n)+ +0\.5 +8\.60", capsys.readouterr().out)


def test_all_programs_are_run():
    """Those of contributing.md are classes, which tests/master/test_recipe.py puts to use."""
    pages = [page for page in PAGES if page.name != "contributing.md"]
    assert set(PROGRAMS) == {(page.name, k) for page in pages for k in range(len(blocks(page, "python")))}


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder that looks like a checkout to commands; a page is followed from its first to its last."""
    folder = tmp_path_factory.mktemp("desk")
    shutil.copytree(ROOT / "master/springbeam/scene/shipped", folder / "master/springbeam/scene/shipped")
    return folder


def shown(text, output):
    """Return the first line of a console block that the output does not have, or None. A line ``⋮`` stands for any
    lines, ``…`` in a line for any text; blanks at the end of a line do not count."""
    lines = [line.rstrip() for line in output.splitlines()]
    at = 0
    skips = False
    for line in text.splitlines():
        if line.strip() == "⋮":
            skips = True
            continue
        pattern = ".*".join(map(re.escape, line.rstrip().split("…")))
        reach = lines[at:] if skips else lines[at : at + 1]
        found = next((k for k, printed in enumerate(reach) if re.fullmatch(pattern, printed)), None)
        if found is None:
            return line
        at += found + 1
        skips = False
    return None if skips or at == len(lines) else f"the end, before {lines[at]}"


@pytest.mark.parametrize("page", shell_pages(), ids=lambda page: page.name)
def test_commands_of_the_documentation_run(desk, page, unpainted, monkeypatch):
    """They end well, complain of nothing, and print what the block ``console`` after them shows."""
    monkeypatch.chdir(desk)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    shutil.rmtree("results", ignore_errors=True)
    output = ""
    for language, block in re.findall(r"^```(sh|console)\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S):
        if language == "console":
            assert (missing_line := shown(block, output)) is None, f"{page.name}: {missing_line}\n{output}"
            continue
        output = ""
        for line in filter(str.strip, block.splitlines()):
            if reason_not_to_run(line):
                continue
            if ">" in line:  # what a shell does; all others are run in this process, which has imported everything
                ran = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=HANGS)
                code = ran.returncode
                said = ran.stderr
            else:
                program, *arguments = shlex.split(line, comments=True)
                assert program == "springbeam"
                result = command(*arguments)
                code = result.exit_code
                said = result.stderr
                output += result.stdout
            assert (code, said) == (0, ""), f"{page.name}: {line}"


def test_what_is_not_run_is_still_there_and_understood():
    for start in NOT_RUN:
        lines = [line for line in shell_lines() if line.startswith(start)]
        assert lines, f"{start}: nowhere in the documentation"
        for line in lines:
            program, *words = shlex.split(line, comments=True)
            if program == "springbeam":
                COMMAND.get_command(None, words[0]).make_context(
                    words[0], words[1:]
                )  # raises if an option or a value is wrong


@pytest.mark.parametrize("name", ["fmu_variables", "lists", "scene"])
def test_generated_pages_are_current(name, monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    for path, text in module(name).files().items():
        assert path.read_text(encoding="utf-8") == text, f"run python docs/{name}.py"


def test_links_between_pages_lead_somewhere():
    for page in PAGES:
        for target, anchor in re.findall(
            r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)", page.read_text(encoding="utf-8")
        ):
            file = (page.parent / target) if target else page
            assert file.exists(), f"{page.name}: {target}"
            if anchor and file.suffix == ".md":
                titles = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.M)
                slugs = [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles]
                assert anchor in slugs, f"{page.name}: {target}#{anchor}"
