"""The results of a run: its records, and what follows from them, in memory and in files.

Imports `scene` only. Start at ``steps``, the record of a step; ``columns``, ``dense`` and ``totals`` are functions of
records. A run hands them to a recorder: ``recording`` keeps them in memory, ``file_recorder`` in a run ``directory``,
``reading`` reads that back as a ``trajectory``. ``contact_times`` tells when two runs were in contact, and how far they
are apart in it.
"""
