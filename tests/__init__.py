"""Tests, and what they share: ``tests.assertions``, ``tests.renderer.scenes``."""
