"""Signals of a run: functions of the user, settled motion, spectra, comparison with measured data.

Imports `results` and `scene`; the mathematics is scipy's. Start at ``curves``, where a signal is named: a column, or a
function of the run. ``spectra`` samples it at equal steps, ``driven`` once a period, ``measured`` at measured times.
"""
