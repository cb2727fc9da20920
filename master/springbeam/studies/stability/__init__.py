"""Where the coupling is stable: predicted from the linear(ised) step, and measured on a grid of extreme scenes.

`linear` has the amplification matrices, `predict` applies them to a scene; `cells` has the extreme scenes, `grid` runs
them and says how each ends.
"""
