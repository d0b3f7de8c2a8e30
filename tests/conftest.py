"""Fixtures for all tests."""

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real meshes and reference numbers beside the checkout; the test skips where it is absent."""
    if not (SHARED / "meshes" / "MANIFEST.csv").is_file():
        pytest.skip("the folder shared/ with real meshes and reference numbers is not beside the checkout")
    return SHARED
