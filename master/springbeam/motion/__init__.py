"""Motion of the ends in a step: paths between two rows, and kinds of events.

Imports nothing of the package. Contact, coupling, run, results and references share it.
"""
