"""Algorithm 1 of Ahn & Tate, and the cases of their Figures 2–5 (``README.md``; command ``springbeam paper``).

The algorithm decides in each step what touches, overwrites states, and changes the energy by that, so it is no contact
law of a run. ``co_simulation`` advances the beam and the spring FMU by it, ``monolithic`` solves the same steps as one
system; neither knows the other. ``problem`` has what both ask of a scene, and makes their results; ``figures`` has
Table 2 and draws runs of a figure's case below each other. Imports `bodies`, `monolithic` (the beam's mesh, and columns
that follow from others), `pictures`, `results` and `scene`, and nothing of a run.
"""
