"""Let `springbeam.bodies.probe` examine a foreign FMU in a process of its own, which may crash or hang."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

from ..scene.partners import ForeignFmu
from .abilities import Abilities
from .foreign import Findings
from .protocol import FmuError

#: Longest time that it may take [s].
PATIENCE = 20.0


def examined(spec: ForeignFmu, upper: bool, start_time: float, H: float) -> Findings:
    """Return what `springbeam.bodies.probe.examine` finds; an FMU is examined once.

    Raises
    ------
    FmuError
        If the FMU cannot be used as the scene says, crashes, or does not return within `PATIENCE`.
    """
    path = Path(spec.fmu)
    if not path.is_file():
        raise FmuError(f"{path}: not found")
    return _examined(spec.model_dump_json(), path.stat().st_mtime_ns, upper, start_time, H)


@lru_cache(maxsize=64)
def _examined(spec: str, modified: int, upper: bool, start_time: float, H: float) -> Findings:
    path = json.loads(spec)["fmu"]
    with tempfile.TemporaryDirectory(prefix="springbeam-") as folder:
        stages, result = Path(folder) / "stages", Path(folder) / "result"
        stages.write_text("loading\n")
        task = json.dumps({"spec": spec, "upper": upper, "start_time": start_time, "H": H, "folder": folder})
        command = [sys.executable, "-m", "springbeam.bodies.probe"]
        try:
            ended = subprocess.run(
                command, input=task, text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=PATIENCE
            )
        except subprocess.TimeoutExpired:
            last = stages.read_text().split("\n")[-2]
            raise FmuError(
                f"{path}: {last} has not returned within {PATIENCE:g} s, in the check before the run"
            ) from None
        if not result.exists():
            last = stages.read_text().split("\n")[-2]
            code = ended.returncode
            cause = (
                signal.Signals(-code).name
                if code < 0
                else (ended.stderr.strip().splitlines() or [f"exit code {code}"])[-1]
            )
            raise FmuError(f"{path}: crashed ({cause}) in {last}, in the check before the run")
        found = json.loads(result.read_text())
    if "error" in found:
        raise FmuError(found["error"])
    return Findings(Abilities(**found["abilities"]), found["mass"], found["velocity"], tuple(found["faults"]))
