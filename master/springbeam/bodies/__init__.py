"""Bodies with one interface end, on which a contact force and impulses act.

Imports `scene` only. Start at ``protocol``, the methods and the state of every body; ``force`` is the polynomial of a
force over a step. ``factory`` makes the bodies of a scene, in ``equilibrium`` where it starts at rest.

* An FMU: ``archive`` finds and unpacks it, ``functions`` loads its library with FMPy, ``fmu`` is an instance, ``port``
  makes the steps of a run, in SI units (``advance.cpp``: its calls as one; ``isolated``: in another process).
* ``fmu_body`` makes a body of a port by a table of variables: ``own`` has those of our two FMUs, ``foreign`` takes that
  of a scene, with ``units``; ``probe`` checks it.
* ``elements`` are masses, springs and ends with a prescribed motion, ``quasi_static`` is a beam without inertia.
"""
