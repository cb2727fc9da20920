"""Every pair of options of a run: it ends well, with complete files, or is refused by one clear error."""

from itertools import combinations
from pathlib import Path

import pytest
import tomli_w
from commands import command
from scenes import TABLE, completed

from springbeam.results.files import load_trajectory
from springbeam.run.ledger import bounds

SCENE = TABLE["scenes"]["in pairs of options"]
OPTIONS = TABLE["options"]


def keys(name):
    """Return the keys that an option sets; of two that set one of them the last counts."""
    return {word.partition("=")[0] for word in OPTIONS[name].split() if word[:2] != "--"}


@pytest.mark.parametrize(
    "pair",
    [p for p in combinations(OPTIONS, 2) if keys(p[0]).isdisjoint(keys(p[1]))],
    ids=" + ".join,
)
def test_a_pair_runs_or_is_refused(tmp_path, monkeypatch, pair):
    monkeypatch.chdir(tmp_path)
    words = " ".join(OPTIONS[name] for name in pair).split()
    left_out = {word.removeprefix("no-") for word in words if word.startswith("no-")}
    Path("scene.toml").write_text(tomli_w.dumps(completed({k: v for k, v in SCENE.items() if k not in left_out})))
    settings = [word for word in words if "=" in word]
    arguments = ["run", "scene.toml", "--out", "run", *(f"--set={word}" for word in settings)]
    arguments += [word for word in words if "=" not in word and word.removeprefix("no-") not in left_out]
    result = command(*arguments, "--no-plots")

    if result.exit_code == 2:
        assert result.stderr.startswith("error: ")
        assert result.stdout == ""
        named = [word.partition("=")[0].rpartition(".")[2] for word in settings]
        for line in result.stderr.splitlines():
            assert any(word in line for word in (*named, *left_out, *(w for w in words if w.startswith("--"))))
        assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.toml"]
        return
    assert (result.exit_code, result.stderr) == (0, "")
    run = load_trajectory("run")
    assert run.summary["status"] == "done"
    assert run.time[-1] == run.scene.time.t_end
    said = any("energy" in warning for warning in run.summary["warnings"])
    coupling = run.scene.coupling
    spring = run.scene.spring
    tolerance = max(coupling.tolerance, 0.0 if spring is None else spring.relative_tolerance)
    most, _ = bounds(tolerance, exchanges=coupling.scheme != "energy")
    assert run.summary["max_energy_residual"] <= most or said
    if "interval" in pair:
        multiples = [float(row.partition(",")[0]) / 1e-3 for row in Path("run/trajectory.csv").read_text().split()[1:]]
        assert multiples == pytest.approx([round(k) for k in multiples], abs=1e-9)
    files = {"trajectory.csv", "events.csv", "steps.bin", "summary.json", *(["shapes.csv"] if run.scene.beam else [])}
    assert {path.name for path in Path("run").iterdir()} == files


@pytest.mark.parametrize("name", OPTIONS)
def test_an_option_alone_runs(tmp_path, monkeypatch, name):
    test_a_pair_runs_or_is_refused(tmp_path, monkeypatch, (name, name))
    assert (tmp_path / "run").exists()
