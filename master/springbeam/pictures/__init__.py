"""Pictures of a run: plots, animation, and the report that opens in a browser.

Imports `results` and `scene` only. ``drawing`` holds colours, labels and scales that all of them share.
"""
