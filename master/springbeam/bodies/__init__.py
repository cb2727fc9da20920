"""What moves: bodies with one interface end, which a contact force and impulses act on.

Imports `scene` only. ``protocol`` says what every body does and how it keeps what changes, ``force`` is the language in
which a force over a step is given. ``functions`` loads the library of an FMU of either version of FMI, ``fmu`` is one
instance of it, and ``advance.cpp`` makes the calls of a step together; ``archive`` finds and unpacks the file.
``fmu_bodies`` has the port through which a run uses an FMU, and makes bodies of ours. ``elements`` are masses, springs
and ends that move as told, ``quasi_static`` is a beam without inertia. ``foreign`` makes a body of an FMU that others
made, whose port ``isolated`` has in a process of its own; ``probe`` examines it. ``gate`` says what bodies must be able
to do and refuses those that a scene cannot be run with. Start at ``protocol``; ``factory`` makes the bodies of a scene.
"""
