"""What the ends do in a step and at its end: paths between two rows, and kinds of events.

Imports nothing of the package. Contact, coupling, run, results and references share these words.
"""
