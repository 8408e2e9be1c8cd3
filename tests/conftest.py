"""Fixtures shared by all tests."""

from __future__ import annotations

import pytest


@pytest.fixture
def silent(capfd):
    """Fails the test that prints anything, C++ code included."""
    yield
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")
