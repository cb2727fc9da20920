"""Where the coupling is stable: predicted from the linear(ised) step, and measured on a grid of extreme scenes.

`predict` has the matrices of a step and applies them to a scene. `draw` draws scenes of a range, `judge` runs one and
judges the run; `grid` does both for extreme scenes, ``tests/campaign`` for usual ones.
"""
