"""The version of the installed package."""

from importlib.metadata import version

__version__ = version(__package__ or "springbeam")
