"""Run in Ecos' own environment. Arguments: a JSON job; prints rows as JSON."""

import json
import sys

from ecospy import EcosSimulation, EcosSimulationStructure


def path(name):
    return name.replace(".", "::", 1)


def structure(job):
    made = EcosSimulationStructure()
    for name, file in job["fmus"].items():
        made.add_model(name, file)
    for start, end in job["connections"]:
        made.make_real_connection(path(start), path(end))
    made.add_parameter_set("soft", {path(name): value for name, value in job["parameters"].items()})
    return made


job = json.loads(sys.argv[1])
system = {"ssp_path": job["ssp"]} if job["ssp"] else {"structure": structure(job)}
with EcosSimulation(step_size=job["size"], **system) as simulation:
    assert simulation.init(parameter_set="soft")
    rows = []
    for _ in range(round(job["end"] / job["size"])):
        time = simulation.step()
        rows.append([time, *(simulation.get_real(path(name)) for name in job["outputs"])])
    simulation.terminate()
print("ROWS " + json.dumps(rows))
