"""What many runs tell: accuracy, checks against references, speed against accuracy, stability, sweeps.

Imports everything but `cli` and ``api``; each study draws its own picture. One module or package per command.
"""
