"""Print an FMU's modelDescription.xml, or its sources/buildDescription.xml, from the table that its code prints.

Usage: description.py 2|3|build3 TABLE LIST

TABLE is what describe_beam or describe_spring prints (table.cpp), LIST a file with the names in sources/ to compile,
one per line.
"""

from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

Variable = dict[str, Any]

# Every unit that the tables use: its quantity, which also names its type, and its exponents of the SI base units.
UNITS: dict[str, tuple[str, dict[str, int]]] = {
    "kg": ("Mass", {"kg": 1}),
    "kg/m3": ("Density", {"kg": 1, "m": -3}),
    "m": ("Length", {"m": 1}),
    "m2": ("Area", {"m": 2}),
    "m4": ("SecondMomentOfArea", {"m": 4}),
    "m/s": ("Velocity", {"m": 1, "s": -1}),
    "m/s2": ("Acceleration", {"m": 1, "s": -2}),
    "m.s": ("Absement", {"m": 1, "s": 1}),
    "m.s2": ("Absity", {"m": 1, "s": 2}),
    "s": ("Time", {"s": 1}),
    "1/s": ("Rate", {"s": -1}),
    "s/m": ("InverseVelocity", {"m": -1, "s": 1}),
    "rad": ("Angle", {"rad": 1}),
    "Pa": ("Pressure", {"kg": 1, "m": -1, "s": -2}),
    "N": ("Force", {"kg": 1, "m": 1, "s": -2}),
    "N/m": ("Stiffness", {"kg": 1, "s": -2}),
    "m/N": ("Compliance", {"kg": -1, "s": 2}),
    "N/m3": ("CubicStiffness", {"kg": 1, "m": -2, "s": -2}),
    "N.m": ("Torque", {"kg": 1, "m": 2, "s": -2}),
    "N.s": ("Impulse", {"kg": 1, "m": 1, "s": -1}),
    "N.s/m": ("Damping", {"kg": 1, "s": -1}),
    "J": ("Energy", {"kg": 1, "m": 2, "s": -2}),
}
TYPES3 = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
ORDERS = (1, 2)  # of the derivatives that an input has


def is_continuous_input(v: Variable) -> bool:
    return v["causality"] == "input" and not v["consumed"]


def is_settable(v: Variable) -> bool:
    return v["causality"] in ("parameter", "input") or v["exact"]


def value_text(v: Variable, value: str) -> str:
    if v["type"] == "Boolean":
        return "true" if float(value) else "false"
    return value if v["type"] == "Real" else str(int(float(value)))


def role(v: Variable) -> dict[str, str]:
    """Return what a variable is for: description, causality, variability, initial."""
    parameter = v["causality"] == "parameter"
    discrete = v["consumed"] or v["discrete"] or v["type"] != "Real"
    attributes = {"description": v["description"], "causality": v["causality"]}
    attributes["variability"] = "fixed" if parameter else "discrete" if discrete else "continuous"
    if v["causality"] != "input":
        attributes["initial"] = "exact" if parameter or v["exact"] else "calculated"
    return attributes


def values(v: Variable) -> dict[str, str]:
    """Return what values a variable has: type, unit, bounds, start."""
    attributes = {}
    if v["unit"]:
        quantity = UNITS[v["unit"]][0]
        attributes |= {"declaredType": quantity, "quantity": quantity, "unit": v["unit"]}
    if v["choice"]:
        attributes["declaredType"] = v["choice"]
    if v["type"] != "Boolean":
        attributes |= {key: value_text(v, v[key]) for key in ("min", "max") if "inf" not in v[key]}
    if v["type"] == "Real" and v["nominal"] != "1":
        attributes["nominal"] = v["nominal"]
    if is_settable(v):
        attributes["start"] = value_text(v, v["start"])
    return attributes


class Description:
    """A modelDescription.xml of FMI `version` 2 or 3. The number of a variable is its place in the table."""

    def __init__(self, table: dict[str, Any], version: int, source_files: list[str]) -> None:
        self.table, self.version = table, version
        self.variables: list[Variable] = table["variables"]
        self.number = {v["name"]: i for i, v in enumerate(self.variables)}
        generator = {"license": "BSD-3-Clause", "generationTool": f"springbeam {table['version']}"}
        about = {key: table[key] for key in ("description", "version")} | generator
        about["variableNamingConvention"] = "structured"
        identity = {"modelName": table["title"], "guid" if version == 2 else "instantiationToken": table["guid"]}
        self.root = ET.Element("fmiModelDescription", {"fmiVersion": f"{version}.0"} | identity | about)
        self._interface(source_files)
        self._definitions()
        (self._variables2 if version == 2 else self._variables3)()
        self._structure()

    def _interface(self, source_files: list[str]) -> None:
        abilities = {"canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "1"}
        early = "true" if self.table["ends_steps_early"] else "false"
        if self.version == 2:
            self.root.set("numberOfEventIndicators", "0")
            yes = "canInterpolateInputs canNotUseMemoryManagementFunctions canGetAndSetFMUstate canSerializeFMUstate"
            no = "needsExecutionTool canRunAsynchronuously canBeInstantiatedOnlyOncePerProcess"
            abilities |= dict.fromkeys(f"{yes} providesDirectionalDerivative".split(), "true")
            abilities |= dict.fromkeys(no.split(), "false")
        else:
            yes = "canGetAndSetFMUState canSerializeFMUState providesDirectionalDerivatives hasEventMode"
            abilities |= dict.fromkeys(yes.split(), "true") | {"mightReturnEarlyFromDoStep": early}
        abilities = {"modelIdentifier": self.table["identifier"]} | abilities
        interface = ET.SubElement(self.root, "CoSimulation", abilities)
        if self.version == 2 and source_files:
            files = ET.SubElement(interface, "SourceFiles")
            for name in source_files:
                ET.SubElement(files, "File", name=name)

    def _definitions(self) -> None:
        used = [name for name in UNITS if name in {v["unit"] for v in self.variables}]
        units = ET.SubElement(self.root, "UnitDefinitions")
        for name in used:
            exponents = {base: str(exponent) for base, exponent in UNITS[name][1].items()}
            ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit", exponents)
        types = ET.SubElement(self.root, "TypeDefinitions")
        for name in used:
            quantity = UNITS[name][0]
            self._type(types, "Real", {"name": quantity}, {"quantity": quantity, "unit": name})
        for choice in self.table["choices"]:
            items = "; ".join(f"{i} = {item}" for i, item in enumerate(choice["items"], 1))
            named = {"name": choice["name"], "description": f"{choice['description']}: {items}"}
            self._type(types, "Integer", named, {"min": "1", "max": str(len(choice["items"]))})
        categories = ET.SubElement(self.root, "LogCategories")
        for category in self.table["log_categories"]:
            ET.SubElement(categories, "Category", category)
        experiment = {"startTime": "0", "stopTime": self.table["stop_time"], "tolerance": self.table["tolerance"]}
        ET.SubElement(self.root, "DefaultExperiment", experiment | {"stepSize": self.table["step_size"]})

    def _type(self, types: ET.Element, kind: str, named: dict[str, str], limits: dict[str, str]) -> None:
        if self.version == 2:
            ET.SubElement(ET.SubElement(types, "SimpleType", named), kind, limits)
        else:
            # Without the description, which FMPy 0.3.20 and older cannot read there.
            ET.SubElement(types, f"{TYPES3[kind]}Type", {"name": named["name"]} | limits)

    def _variables2(self) -> None:
        listed = ET.SubElement(self.root, "ModelVariables")
        for i, v in enumerate(self.variables):
            listed.append(ET.Comment(f" index {i + 1} "))
            named = {"name": v["name"], "valueReference": str(i)}
            ET.SubElement(ET.SubElement(listed, "ScalarVariable", named | role(v)), v["type"], values(v))

    def _reference3(self, i: int, order: int = 0) -> str:
        return str(i + order * (len(self.variables) + 1))  # references3.hpp

    def _variables3(self) -> None:
        listed = ET.SubElement(self.root, "ModelVariables")
        time = {"name": "time", "valueReference": self._reference3(len(self.variables)), "description": "time"}
        time |= {"causality": "independent", "variability": "continuous", "declaredType": "Time", "unit": "s"}
        ET.SubElement(listed, "Float64", time)
        for i, v in enumerate(self.variables):
            if v["elements"] == 0:
                continue
            array = v["elements"] > 1
            named = {"name": v["name"].partition("[")[0] if array else v["name"]}
            named["valueReference"] = self._reference3(i)
            element = ET.SubElement(listed, TYPES3[v["type"]], named | role(v) | values(v))
            if array:
                ET.SubElement(element, "Dimension", start=str(v["elements"]))
        for i, v in enumerate(self.variables):
            if not is_continuous_input(v) or v["held"]:
                continue
            for order in ORDERS:  # FMI 3.0 has no input derivatives of its own: they are inputs
                derivative = {
                    "name": f"der({v['name']}" + (f",{order})" if order > 1 else ")"),
                    "valueReference": self._reference3(i, order),
                    "description": f"derivative of order {order} over the next step, then 0 again",
                    "causality": "input",
                    "variability": "continuous",
                    "start": "0",
                    "derivative": self._reference3(i, order - 1),
                }
                ET.SubElement(listed, "Float64", derivative)

    def _settable(self) -> list[str]:
        """Return what is set before the start and acts there: an impulse acts in the first step."""
        return [v["name"] for v in self.variables if is_settable(v) and not v["consumed"]]

    def _structure(self) -> None:
        structure = ET.SubElement(self.root, "ModelStructure")
        for kind in ("Output", "InitialUnknown"):
            parent = ET.SubElement(structure, f"{kind}s") if self.version == 2 else structure
            for i, v in enumerate(self.variables):
                if v["causality"] != "output" or (kind == "InitialUnknown" and v["exact"]):
                    continue
                if self.version == 2:
                    unknown = ET.SubElement(parent, "Unknown", index=str(i + 1))
                else:
                    unknown = ET.SubElement(parent, kind, valueReference=self._reference3(i))
                if kind == "Output":
                    known = v["dependencies"]
                else:
                    names = v["initial_dependencies"]
                    known = [[name, 0] for name in (self._settable() if names is None else names)]
                    known += [[name, order] for name, order in v["dependencies"] if order > 0]
                on = {(self.number[name], order) for name, order in known if self.version == 3 or order == 0}
                numbers = {str(j + 1) if self.version == 2 else self._reference3(j, order) for j, order in on}
                unknown.set("dependencies", " ".join(sorted(numbers, key=int)))


def build_description(table: dict[str, Any], source_files: list[str]) -> ET.Element:
    """Return FMI 3.0's list of what to compile. C files have no set of their own: FMPy compiles the first set alone."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=table["identifier"])
    files = ET.SubElement(configuration, "SourceFileSet", language="C++17")
    for name in source_files:
        ET.SubElement(files, "SourceFile", name=name)
    ET.SubElement(files, "IncludeDirectory", name=".")
    return root


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    table = json.loads(Path(sys.argv[2]).read_text(encoding="utf-8"))
    source_files = Path(sys.argv[3]).read_text(encoding="utf-8").split()
    if sys.argv[1] == "build3":
        root = build_description(table, source_files)
    else:
        root = Description(table, int(sys.argv[1]), source_files).root
    ET.indent(root)
    print('<?xml version="1.0" encoding="UTF-8"?>')
    print(ET.tostring(root, encoding="unicode"))
