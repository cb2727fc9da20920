"""Where the coupling is stable: predicted from the linear(ised) step, and measured on a grid of extreme scenes.

`predict` has the matrices of a step and applies them to a scene; `cells` has the extreme scenes, `grid` runs
them and says how each ends.
"""
