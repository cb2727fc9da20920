"""What a run leaves: columns, events, shapes and summary, in memory (``trajectory``) and in files (``recording``).

Imports `scene` only. ``contact_times`` compares when two runs were in contact. Start at ``trajectory``.
"""
