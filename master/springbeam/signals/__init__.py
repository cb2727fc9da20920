"""What an engineer asks of the curves of a run: own numbers, settled motion, spectra, measured data beside them.

Imports `results` and `scene`; the mathematics is scipy's. Start at ``curves``, by which a signal is named: a
column, or a function of the run. ``spectra`` takes it at equal steps, ``driven`` once a period, ``measured`` where it
was measured.
"""
