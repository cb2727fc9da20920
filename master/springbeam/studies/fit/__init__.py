"""Fits: keys of a scene found by measured curves, with confidence intervals and a verdict.

`study` makes the runs and shows what was found. `multistart` searches from runs all over the `ranges` of the keys, each
time by the least squares of `least`, and judges the best minimum; `verdict` says whether the data determines it.
"""
