"""Fixtures shared by all tests."""

from __future__ import annotations

import signal

import pytest

# a job in the background of a shell is started with Ctrl-C ignored, and its children inherit that: here it is to be felt
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def silent(capfd):
    """Fails the test that prints anything, C++ code included."""
    yield
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


def pytest_collection_modifyitems(config, items):
    """Slow tests are left out unless -m says something."""
    if not config.getoption("-m"):
        slow = [item for item in items if item.get_closest_marker("slow")]
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if item not in slow]
