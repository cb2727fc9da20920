"""What moves: bodies with one interface end, which a contact force and impulses act on.

Imports `scene` only. ``protocol`` says what every body does, ``force`` is the language in which a force over a step is
given, ``fmu`` holds one FMU (the only FMPy import), ``fmu_bodies`` makes bodies of the two FMUs, ``quasi_static`` is a
beam without inertia, ``rigid_wall`` an end that nothing moves. Start at ``protocol``; ``factory`` makes the bodies of a
scene.
"""
