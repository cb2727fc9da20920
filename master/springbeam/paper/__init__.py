"""Algorithm 1 of Ahn & Tate, and the cases of their Figures 2–5 (``docs/paper.md``; command ``springbeam paper``).

The algorithm decides in each step what touches, overwrites states, and changes the energy by that, so it is no contact
law of a run. ``co_simulation`` advances the beam and the spring FMU by it, ``monolithic`` solves the same steps as one
system; neither knows the other. ``problem`` has what both ask of a scene, and makes their results. Imports `bodies`,
`monolithic` (mesh and energies of the beam) and `scene`, and nothing of a run.
"""
