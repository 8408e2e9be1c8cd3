"""Checks of single values: what counts as a number, a whole number, a switch, a sign, a choice."""

import numpy as np
import pytest

from femmembrane import checks
from femmembrane.errors import InputError


@pytest.mark.parametrize("value", [True, "4", None, 4.0, np.float64(4), [4], 0, 9])
def test_what_is_no_whole_number_from_1_to_8(value):
    assert not checks.is_whole(value, most=8)
    with pytest.raises(InputError, match=r"key = .*: a whole number from 1 to 8 is allowed"):
        checks.whole("key", value, most=8)


def test_whole_numbers_of_numpy_become_ints():
    found = checks.whole("key", np.int32(4))
    assert found == 4
    assert type(found) is int


@pytest.mark.parametrize("value", [np.nan, np.inf, True, "1", None, 0.5, 3])
def test_what_is_not_between_two_bounds(value):
    with pytest.raises(InputError, match="a number from 1 to 2 is allowed"):
        checks.between("key", value, 1, 2)


def test_bounds_may_be_left_out():
    assert checks.between("key", 1, 1, 2) == 1.0
    with pytest.raises(InputError):
        checks.between("key", 1, 1, 2, ends=False)


def test_infinity_is_never_between():
    with pytest.raises(InputError):
        checks.between("key", np.inf, 0, np.inf)


@pytest.mark.parametrize("value", [0, 2, True, "1", None, 1.5, [1]])
def test_what_is_no_sign(value):
    with pytest.raises(InputError, match="1 or -1 is allowed"):
        checks.sign("key", value)


@pytest.mark.parametrize("value", [["ipopt"], "Newton", 5, None])
def test_a_choice_is_one_of_its_names(value):
    with pytest.raises(InputError, match="known: ipopt, newton"):
        checks.choice("solver", value, {"ipopt": 1, "newton": 2})


@pytest.mark.parametrize("given", [{}, {"a": 1, "b": 2}])
def test_exactly_one_argument(given):
    with pytest.raises(InputError, match="exactly one"):
        checks.only("verb", {"a": None, "b": None, **given}, "exactly one of a and b is allowed")
    assert checks.only("verb", {"a": None, "b": 0}, "") == ("b", 0)


def test_a_list_that_never_ends_is_refused():
    with pytest.raises(InputError, match="up to 3 are allowed"):
        checks.sequence("key", iter(int, 1), "a list is allowed", 3)
