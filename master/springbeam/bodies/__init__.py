"""Bodies with one interface end, on which a contact force and impulses act.

Imports `scene` only. ``protocol`` defines the methods and the state of every body, ``force`` the polynomial of a force
over a step. ``functions`` loads the library of an FMU of either version of FMI, ``fmu`` is one instance of it, and
``advance.cpp`` makes the calls of a step together; ``archive`` finds and unpacks the file. ``fmu_bodies`` has the port
through which a run uses an FMU, and our two FMUs as bodies. ``elements`` are masses, springs and ends with a prescribed
motion, ``quasi_static`` is a beam without inertia. ``foreign`` makes a body of an FMU of others, whose port
``isolated`` runs in another process; ``probe`` checks it. ``gate`` rejects bodies that lack an ability which a scene
needs. Start at ``protocol``; ``factory`` makes the bodies of a scene.
"""
