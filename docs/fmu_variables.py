"""Writes docs/fmu_variables.md from the model descriptions of the built FMUs: python docs/fmu_variables.py"""

from __future__ import annotations

import re
from pathlib import Path

from fmpy import read_model_description
from pages import DOCS, table  # beside this script

TARGET = DOCS / "fmu_variables.md"
HEAD = """# Variables of the FMUs

Everything is SI, up is positive; what the symbols mean is in [model.md](model.md). Every input but an impulse is
continued over a step by its FMI input derivatives of order 1 and 2. What is local can be read like an output; tools
that record or plot every output leave it alone. (Made from the FMUs by `python docs/fmu_variables.py`.)
"""


def section(name: str) -> str:
    description = read_model_description(str(DOCS.parent / "fmus" / f"{name}.fmu"))
    rows = []
    shown: set[str] = set()
    for variable in description.modelVariables:
        stem = variable.name.split("[")[0]
        if stem in shown:
            continue
        label = variable.name
        if stem != variable.name:
            shown.add(stem)
            label = f"{stem}[1..{sum(v.name.startswith(stem + '[') for v in description.modelVariables)}]"
        start = "" if variable.start is None else str(variable.start)
        unit = f" [{variable.unit}]" if variable.unit else ""
        kind = variable.causality if variable.type == "Real" else f"{variable.type} {variable.causality}"
        text = re.sub(r"; derivatives as for \w+", "", variable.description or "").replace("|", "\\|")  # HEAD says it
        if label != variable.name:  # what is said of the first
            text = text.replace("[1]", "[i]").replace("L*0/20", "L*(i - 1)/20")
        rows.append((f"`{label}`{unit}", kind, start, text))
    return "\n".join([f"\n## {name}\n", *table(("variable", "kind", "start", ""), rows), ""])


def files() -> dict[Path, str]:
    return {TARGET: HEAD + section("beam") + section("spring")}


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
