"""Every hard case ends as its registry says; README.md in this folder lists them all."""

from __future__ import annotations

import os
import sys
import time
import warnings

import pytest

import femmembrane as fm

from . import registry
from .registry import Case, Done, Exit, Family, Number, Stop, cases, outcome
from .table import README, differences

CASES = cases()
RAN: list[Case] = []


@pytest.mark.parametrize("case", [pytest.param(c, marks=[pytest.mark.slow] if c.slow else [], id=c.id) for c in CASES])
def test_hard_case(case):
    RAN.append(case)
    assert outcome(case).fault == ""


def test_the_readme_lists_every_case():
    """What the table says came out is compared for the cases that have run in this session."""
    known = {case: outcome(case) for case in CASES if case in RAN}
    assert differences(README.read_text(encoding="utf-8"), CASES, known) == []


# --- the harness itself: what it may not let pass


def judged(expected, run, **options):
    family = Family(0, "harness")
    family.case("one", "", expected, **options)(run)
    return outcome(family.cases[0]).fault


@pytest.mark.parametrize(
    ("expected", "run", "fault"),
    [
        (Number(1.0, rel=1e-6), lambda: 1.0 + 2e-6, "in place of 1.0"),
        (Number(1.0, abs=1e9), lambda: float("nan"), "nan"),
        (Number((1.0, 2.0)), lambda: 1.0, "1 number(s) in place of 2"),
        (Number(1.0), lambda: sys.stdout.write("hello") and 1.0, "printed 'hello'"),
        (Number(1.0), lambda: os.write(2, b"from C") and 1.0, "printed 'from C'"),
        (Number(1.0), lambda: warnings.warn("careful", stacklevel=1), "UserWarning: careful"),
        (Number(1.0), lambda: 1 / 0, "ZeroDivisionError"),
        (Stop("mesh.elements"), lambda: fm.disc(elements=1.5), ""),
        (Stop("mesh.degree"), lambda: fm.disc(elements=1.5), "mesh.elements in place of mesh.degree"),
        (Stop(fm.Status.SLACK), lambda: 1.0, "in place of a stop"),
        (Exit(2), lambda: Done(3, err="no\n"), "3 in place of 2"),
        (Exit(3), lambda: Done(3, err="two\nlines\n"), "printed"),
        (Exit(0), lambda: Done(0, out="chatter"), "printed"),
    ],
)
def test_the_harness_lets_nothing_pass(expected, run, fault):
    found = judged(expected, run)
    assert fault in found
    assert bool(found) == bool(fault)


def test_a_hang_is_a_failure(monkeypatch):
    monkeypatch.setattr(registry, "LIMIT", 0.2)
    assert "TimeoutError" in judged(Number(1.0), lambda: time.sleep(30))
