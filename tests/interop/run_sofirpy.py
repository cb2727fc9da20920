"""Run in sofirpy's own environment. Arguments: a JSON job; prints rows as JSON.

sofirpy exchanges nothing before the first step; parameters and start values of inputs are given alike.
"""

import json
import sys

import sofirpy

job = json.loads(sys.argv[1])
connections, values, logged = {}, {name: {} for name in job["fmus"]}, {name: [] for name in job["fmus"]}
for start, end in job["connections"]:
    (source, output), (target, name) = start.split("."), end.split(".")
    made = {"parameter_name": name, "connect_to_system": source, "connect_to_external_parameter": output}
    connections.setdefault(target, []).append(made)
for path, value in job["parameters"].items():
    fmu, name = path.split(".")
    values[fmu][name] = value
for path in job["outputs"]:
    fmu, name = path.split(".")
    logged[fmu].append(name)
steps = round(job["end"] / job["size"])
rows = sofirpy.simulate(
    stop_time=(steps + 0.5) * job["size"],
    step_size=job["size"],
    fmu_paths=job["fmus"],
    connections_config=connections,
    start_values=values,
    parameters_to_log=logged,
)
print("ROWS " + json.dumps([[float(x) for x in row] for row in rows[["time", *job["outputs"]]].values[1:]]))
