"""Run in PathSim's own environment. Arguments: a JSON job; prints rows as JSON.

PathSim steps one FMU after the other and transfers outputs at once (Gauss–Seidel). So the spring is stepped first, and
a sample and hold gives the beam the force that the spring had before its step.
"""

import json
import sys

from pathsim import Connection, Simulation
from pathsim.blocks import SampleHold, Scope
from pathsim_fmi import CoSimulationFMU

job = json.loads(sys.argv[1])
size = job["size"]


def fmu(name):
    values = {path.split(".")[1]: value for path, value in job["parameters"].items() if path.startswith(f"{name}.")}
    return CoSimulationFMU(job["fmus"][name], name, values, size)


fmus = {name: fmu(name) for name in sorted(job["fmus"], reverse=True)}
hold = SampleHold(T=size)
connections = []
for start, end in job["connections"]:
    (source, output), (target, name) = start.split("."), end.split(".")
    if source == "spring":
        connections += [Connection(fmus[source][output], hold), Connection(hold, fmus[target][name])]
    else:
        connections.append(Connection(fmus[source][output], fmus[target][name]))
source, output = job["outputs"][0].split(".")
scope = Scope(sampling_period=size)
connections.append(Connection(fmus[source][output], scope))
blocks = [hold, *fmus.values(), scope] if job["connections"] else [*fmus.values(), scope]
simulation = Simulation(blocks, connections, dt=size, log=False)
simulation.run(job["end"] - 1.5 * size, adaptive=False)  # its first step is at time 0
times, (values,) = scope.read()
print("ROWS " + json.dumps([[float(time) + size, float(value)] for time, value in zip(times, values, strict=True)]))
