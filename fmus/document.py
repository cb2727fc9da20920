"""Write an FMU's documentation/index.html from its modelDescription.xml, its equations and its list of source files.

Usage: document.py modelDescription.xml equations.html LIST OUT
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from html import escape
from pathlib import Path

STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
    "table{border-collapse:collapse;width:100%}td,th{border:1px solid #ccc;padding:.2em .5em;text-align:left;"
    "vertical-align:top}code{white-space:nowrap}"
)
HEADINGS = {"parameter": "Parameters", "input": "Inputs", "output": "Outputs", "local": "Shape", "independent": "Time"}


def row(variable: ET.Element) -> str:
    kind = variable[0] if variable.tag == "ScalarVariable" else variable  # FMI 2.0, FMI 3.0
    dimension = variable.find("Dimension")
    size = "" if dimension is None else f"[{dimension.get('start')}]"
    bounds = f"[{kind.get('min', '−∞')}, {kind.get('max', '∞')}]" if kind.get("min") or kind.get("max") else ""
    cells = [
        f"<code>{escape(variable.get('name', ''))}</code>",
        escape(kind.tag) + size,
        escape(kind.get("unit", "–")),
        escape(kind.get("start", "")),
        bounds,
        escape(variable.get("description", "")),
    ]
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def document(description: ET.Element, equations: str, with_sources: bool) -> str:
    parts = [
        "<!DOCTYPE html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(description.get("modelName", ""))}</title>',
        f"<style>{STYLE}</style></head><body>",
        f"<h1>{escape(description.get('modelName', ''))}</h1>",
        f"<p>{escape(description.get('description', ''))}. Version {escape(description.get('version', ''))}.</p>",
        equations,
    ]
    variables = description.findall("ModelVariables/*")
    for causality, heading in HEADINGS.items():
        if causality not in {v.get("causality") for v in variables}:
            continue
        parts.append(f"<h2>{heading}</h2><table>")
        parts.append(
            "<tr>" + "".join(f"<th>{h}</th>" for h in ("Name", "Type", "Unit", "Start", "Range", "")) + "</tr>"
        )
        parts += [row(v) for v in variables if v.get("causality") == causality]
        parts.append("</table>")
    parts.append("<h2>Sources</h2><p>")
    if with_sources:
        parts.append(
            "The files that modelDescription.xml or buildDescription.xml names are compiled as C++17 and C, with "
            "<code>sources/</code> as the only include folder (<code>fmpy compile</code>). "
            "<code>-fvisibility=hidden -ffp-contract=off</code> are what the binaries here were made with."
        )
    else:
        parts.append("To read: the source of SUNDIALS, which is needed to compile them, is not packed.")
    parts.append("</p>")
    parts.append('<h2>Licences</h2><p>See <a href="licenses/">licenses/</a>.</p></body></html>')
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    xml, equations, sources, out = (Path(argument) for argument in sys.argv[1:])
    with_sources = sources.stat().st_size > 0
    page = document(ET.parse(xml).getroot(), equations.read_text(encoding="utf-8"), with_sources)
    out.write_text(page, encoding="utf-8")
