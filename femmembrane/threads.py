"""One thread for linear algebra on one meridian.

Its matrices are narrow bands and batches of tiny products: handing them to several BLAS threads costs more than the work itself,
and the order of summation would depend on their number. Every public computation runs under :func:`one_thread`, so that results are the
same to the last bit however many threads a machine has. Parallelism belongs a level higher, to whole scenes.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")


@functools.cache
def _controller() -> ThreadpoolController:
    # looked up once, after the numerical libraries are loaded: finding them takes milliseconds, limiting them microseconds
    return ThreadpoolController()


def one_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Run a function with BLAS limited to one thread; the caller's setting is restored afterwards."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> T:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
