"""The results of a run: columns, events, shapes and summary, in memory and in files.

Imports `scene` only. Start at ``trajectory``. A run reports to a recorder: ``recording`` keeps everything in memory,
``file_recorder`` streams into a run ``directory``, ``reading`` reads that back. ``contact_times`` tells when two runs
were in contact, and how far they are apart in it.
"""
