"""What moves: bodies with one interface end, which a contact force and impulses act on.

Imports `scene` only. ``protocol`` says what every body does, ``stateful`` how it keeps what changes, ``force`` is the
language in which a force over a step is given. ``fmu`` holds one FMU and ``functions`` its C functions in either
version of FMI, ``fmu_bodies`` makes bodies of our FMUs, ``quasi_static`` is a beam without inertia, ``elements`` are
masses, springs and ends that move as told, ``end_loaded`` is what bodies with loads on their end share. ``foreign`` is
an FMU that others made, ``probe`` examines it, both in a process that ``isolated`` starts, and ``abilities`` says what
that allows. Start at ``protocol``; ``factory`` makes the bodies of a scene.
"""
