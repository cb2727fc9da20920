"""Motion in a step: curves of positions and forces, and kinds of events.

Imports nothing of the package. Contact, coupling, run, results and references share it.
"""
