"""Studies of many runs: predictions, checks against references, cost of an accuracy, sweeps, fits.

Imports everything but `cli` and ``api``; each study draws its own picture. One module or package per command.
"""
