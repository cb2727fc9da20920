"""Studies for workers: what these processes load is this module, and not what tests need beside it."""

import os
import signal
from pathlib import Path

from draw import EXTREME, drawn, slice_cells
from grid import Grid

from springbeam.studies.sweep import Sweep


class Deadly(Sweep):
    """A sweep that kills its worker where the mass is 3 kg, and the first time, of which it leaves a note, at 2 kg."""

    note: str = ""

    def record(self, case):
        first = case["spring.mass"] == 2.0 and not Path(self.note).exists()
        if first:
            Path(self.note).touch()
        if first or case["spring.mass"] == 3.0:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().record(case)


class Part(Grid):
    """Cells of the hypercube, and corners of the slices."""

    def cases(self):
        cells = [*({"slice": ""} | cell for cell in drawn(EXTREME, 20, 3)[:10]), *slice_cells(2)[:30:5]]
        return {str(k): cell for k, cell in enumerate(cells)}
