"""The results of a run: its records, and what follows from them, in memory and in files.

Imports `scene` and `motion` only. Start at ``steps``, the record of a step; ``columns``, ``dense`` and ``totals`` are
functions of records. A run hands them to a recorder: ``recording`` keeps them in memory or in a run ``directory``,
whose ``files`` are written and read back as a ``trajectory``. ``contact_times`` tells when two runs were in contact,
and how far they are apart in it.
"""
