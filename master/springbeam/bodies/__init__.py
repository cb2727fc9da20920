"""What moves: bodies with one interface end, which a contact force and impulses act on.

Imports `scene` only. ``protocol`` says what every body does and how it keeps what changes, ``force`` is the language in
which a force over a step is given. ``fmu`` holds one FMU and ``functions`` its C functions in either version of FMI;
``advance.cpp`` calls those of a step together. ``archive`` finds and unpacks its file, ``fmu_bodies`` makes bodies of
our FMUs. ``elements`` are masses, springs and ends that move as told, ``quasi_static`` is a beam without inertia.
``foreign`` is an FMU that others made, ``probe`` examines it, both in a process that ``isolated`` starts. ``gate`` says
what bodies must be able to do and refuses those that a scene cannot be run with. Start at ``protocol``; ``factory``
makes the bodies of a scene.
"""
