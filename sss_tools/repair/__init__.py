"""Repair: make a mesh fit for light inside it without inventing more surface than asked for."""

from .ladder import repair_mesh
from .result import Repair, Rung

__all__ = ["Repair", "Rung", "repair_mesh"]
