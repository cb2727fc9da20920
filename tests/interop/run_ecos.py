"""Run in Ecos' own environment. Arguments: a JSON job; prints rows as JSON."""

import json
import sys

from ecospy import EcosSimulation, EcosSimulationStructure


def path(name: str) -> str:
    return name.replace(".", "::", 1)


job = json.loads(sys.argv[1])
with EcosSimulationStructure() as structure:
    for name, file in job["fmus"].items():
        structure.add_model(name, file)
    for start, end in job["connections"]:
        structure.make_real_connection(path(start), path(end))
    structure.add_parameter_set("scene", {path(name): value for name, value in job["parameters"].items()})
    with EcosSimulation(structure=structure, step_size=job["size"]) as simulation:
        assert simulation.init(parameter_set="scene")
        rows = []
        for _ in range(round(job["end"] / job["size"])):
            time = simulation.step()
            rows.append([time, *(simulation.get_real(path(name)) for name in job["outputs"])])
        simulation.terminate()
print("ROWS " + json.dumps(rows))
