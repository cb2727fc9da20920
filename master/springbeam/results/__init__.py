"""The results of a run: its records and functions of them, in memory and in files.

Imports `scene` and `motion` only. Start at ``steps``, the record of a step; ``columns``, ``dense`` and ``totals`` are
functions of records. A run passes them to a recorder: ``recording`` keeps them in memory or in a run ``directory``,
whose ``files`` are written and read back as a ``trajectory``. ``contact_times`` has the times of contact of a run, and
their differences between two runs.
"""
