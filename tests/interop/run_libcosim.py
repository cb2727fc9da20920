"""Run in libcosim's own environment: the pair, or one FMU. Arguments: a JSON job; prints rows as JSON."""

import json
import sys

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

job = json.loads(sys.argv[1])
log_output_level(CosimLogLevel.ERROR)
if job["ssp"]:
    execution = CosimExecution.from_ssp_file(job["ssp"], step_size=job["size"] * 1e9)
    slaves = {slave.name.decode(): slave.index for slave in execution.slave_infos()}
else:
    execution = CosimExecution.from_step_size(job["size"] * 1e9)
    local = {n: CosimLocalSlave(fmu_path=path, instance_name=n) for n, path in job["fmus"].items()}
    slaves = {n: execution.add_local_slave(slave) for n, slave in local.items()}
reference = {n: {v.name.decode(): v.reference for v in execution.slave_variables(i)} for n, i in slaves.items()}
setters = {
    bool: execution.boolean_initial_value,
    int: execution.integer_initial_value,
    float: execution.real_initial_value,
}
if not job["ssp"]:
    for name, value in job["parameters"].items():
        slave, variable = name.split(".")
        assert setters[type(value)](slaves[slave], reference[slave][variable], value), name
    for start, end in job["connections"]:
        (a, x), (b, y) = start.split("."), end.split(".")
        execution.connect_real_variables(slaves[a], reference[a][x], slaves[b], reference[b][y])
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
rows = []
for i in range(round(job["end"] / job["size"])):
    execution.step()
    row = [(i + 1) * job["size"]]
    for name in job["outputs"]:
        slave, variable = name.split(".")
        row.append(observer.last_real_values(slaves[slave], [reference[slave][variable]])[0])
    rows.append(row)
print("ROWS " + json.dumps(rows))
