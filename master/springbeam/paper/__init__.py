"""Algorithm 1 of Ahn & Tate, and the cases of their Figures 2–5 (``README.md``; command ``springbeam paper``).

The algorithm decides in each step what touches, overwrites states, and changes the energy by that, so it is no contact
law of a run. ``algorithm`` has its lines; ``co_simulation`` advances the beam and the spring FMU in them,
``monolithic`` solves the same steps by matrices, and neither knows the other. ``problem`` has what it asks of a scene,
and makes the results. Imports `bodies`, `monolithic` (the beam's mesh, and columns that follow from others), `results`
and `scene`, and nothing of a run.
"""
