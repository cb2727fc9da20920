"""The results of a run: its records and functions of them, in memory and in files.

Imports `scene` and `motion` only. Start at ``records``, the three arrays that are a run. ``recording`` keeps them in
memory or in a run ``directory``, whose ``files`` are read back as a ``trajectory``. Functions of them:

* ``columns`` at the rows, ``dense`` and ``inner`` between them, ``spans`` for their ranges and rounding;
* ``totals``: the results of a run, with ``law_peak`` and ``window_peak`` for the largest force; their errors in words,
  ``judged``;
* ``contacts``, each contact of a run, by its ``contact_times``; ``contact_changes`` and ``distance`` compare two runs.
"""
