"""The methods that studies compare: our shaders, and how each is asked for."""

from __future__ import annotations

from ..render import Settings

FAST = ("plumb", "scalar", "diffuse")
SHADERS = ("path", *FAST)


def settings(method: str, seed: int, threads: int | None = None) -> Settings:
    """Of a renderer for one method. Diffuse is nobody's wish: an object without an inside falls back to it."""
    shader, handling = ("auto", "surface") if method == "diffuse" else (method, "auto")
    return Settings(shader, handling, seed=seed, threads=threads)


def options(method: str) -> list[str]:
    """The same as arguments of ``sss-render``, but for the seed."""
    return ["--hole-handling", "surface"] if method == "diffuse" else ["--shader", method]
