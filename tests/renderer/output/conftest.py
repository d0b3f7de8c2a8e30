"""Films of random samples."""

import numpy as np
import pytest

from renderer.output.film import Film

HEIGHT, WIDTH = 5, 7


def random_samples(passes: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (passes, h, w, 3) float32 over six orders of magnitude, and hits (passes, h, w)."""
    generator = np.random.default_rng(seed)
    radiance = np.exp(generator.normal(0, 2.5, (passes, HEIGHT, WIDTH, 3))).astype(np.float32)
    hits = generator.random((passes, HEIGHT, WIDTH)) < 0.7
    hits[:, 1:3, 2:5] = True  # surely the object
    return radiance, hits


def film_of(radiance, hits, start: int = 0, stop: int | None = None) -> Film:
    """A film of the passes from ``start`` to ``stop``."""
    film = Film.blank((WIDTH, HEIGHT), "abc", 3)
    for index in range(start, len(radiance) if stop is None else stop):
        film.add_pass(index, radiance[index], hits[index])
    return film


@pytest.fixture
def samples():
    return random_samples(40)


@pytest.fixture
def film(samples) -> Film:
    return film_of(*samples)
