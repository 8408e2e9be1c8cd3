"""Two runs in one folder: one holds it."""

from __future__ import annotations

from pathlib import Path

import pytest

import femmembrane as fm
from femmembrane.lock import NAME, locked

fcntl = pytest.importorskip("fcntl")


def test_one_at_a_time(tmp_path):
    with locked(tmp_path), pytest.raises(fm.InputError, match="is writing to it"), locked(tmp_path):
        pass
    with locked(tmp_path):
        pass
    assert not (tmp_path / NAME).exists()


def test_a_lock_whose_file_was_removed_before_it_was_taken_holds_nothing(tmp_path, monkeypatch):
    """Its last holder removes the file between opening and locking it: the next one makes a file anew, which a third meets locked."""
    flock, removed = fcntl.flock, []

    def late(descriptor, operation):
        if not removed:
            removed.append(tmp_path / NAME)
            Path.unlink(tmp_path / NAME)
        return flock(descriptor, operation)

    monkeypatch.setattr(fcntl, "flock", late)
    with locked(tmp_path):
        assert removed
        assert (tmp_path / NAME).exists()
        with pytest.raises(fm.InputError, match="is writing to it"), locked(tmp_path):
            pass
