"""Lights in the unit-size frame: what they send where, and how to draw a point on them.

Radiance is the same in every frame; the intensity of a point light, in power per solid angle, is divided by the
squared scale so that intensity over squared distance stays the scene's irradiance.
"""

from .environment import UNEVEN_SKY, Environment, fibonacci_directions
from .illumination import Illumination, column
from .light_set import LightSet
from .points import DirectionalSource, PointSource
from .rectangle import RectangleSource, spherical_rectangle
from .sphere import SphereSource

__all__ = [
    "UNEVEN_SKY",
    "DirectionalSource",
    "Environment",
    "Illumination",
    "LightSet",
    "PointSource",
    "RectangleSource",
    "SphereSource",
    "column",
    "fibonacci_directions",
    "spherical_rectangle",
]
