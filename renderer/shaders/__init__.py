"""How each object's light is found: path follows it, plumb and scalar know it, diffuse is their fallback."""

from . import diffuse, plumb, scalar

FAST_SHADERS = {shader.NAME: shader for shader in (plumb, scalar, diffuse)}
"""All but path, by name."""

__all__ = ["FAST_SHADERS", "diffuse", "plumb", "scalar"]
