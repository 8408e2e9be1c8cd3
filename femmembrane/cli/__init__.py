"""The command ``femmembrane``: a scene file in, a folder of results out.

Exit codes: 0 done, 2 bad input (nothing was computed), 3 not converged (what was computed is written), 4 results could not be written (a
full disk, too little memory), 130 interrupted (what was computed is written, and ``run --resume`` goes on).
What was written is said on stdout, also in a pipe; errors are one line each on stderr. There is one module a command. Slow imports stand
inside its functions, so that ``--help`` answers at once.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError

from .. import __version__
from ..errors import InputError
from . import completion, convergence, cost, explore, export, fit, report, run, scenes, sweep, switch, view
from .interrupts import ignore_further
from .outcome import BAD_INPUT, DONE, INTERRUPTED, NOT_CONVERGED, NOT_WRITTEN, drop, fail, no_room, open_streams

__all__ = ["BAD_INPUT", "DONE", "INTERRUPTED", "NOT_CONVERGED", "NOT_WRITTEN", "app", "main"]

app = App(
    name="femmembrane",
    help="Equilibria and stability of inflated magnetoelastic membranes.",
    version=__version__,
    help_format="plaintext",  # the import of a markdown parser is a quarter of the time to the first line
    version_format="plaintext",
    suppress_keyboard_interrupt=False,
)

for command in (
    run.run,
    sweep.sweep,
    switch.switch,
    convergence.convergence,
    cost.cost,
    fit.fit,
    report.report,
    explore.explore,
    view.view,
    export.export,
    scenes.scenes,
    scenes.new,
):
    app.command(command)
app.command(completion.install_completion, name="--install-completion")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``femmembrane``; those of the process by default.
    """
    code = _answer(arguments)
    if code == INTERRUPTED and arguments is None:
        ignore_further()
    return code


def _answer(arguments: Sequence[str] | None) -> int:
    """The exit code of a command; whatever goes wrong is said."""
    open_streams()
    os.environ["MPLBACKEND"] = "agg"  # pictures go to files; the backend of a notebook need not exist here
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # the place of its list of fonts is not worth a message
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()  # a full disk is reported here, not by Python when it ends
    except CycloptsError as error:
        return fail(BAD_INPUT, f"{error} Try femmembrane --help.")
    except BrokenPipeError:  # the reader of the pipe has seen enough
        drop(sys.stdout)
        return DONE
    except InputError as error:
        return fail(BAD_INPUT, str(error))
    except OSError as error:
        if _no_memory(error):
            return fail(NOT_WRITTEN, _MEMORY % (error.strerror or error))
        try:
            sys.stdout.flush()
        except OSError:
            drop(sys.stdout)
        if no_room(error):
            return fail(NOT_WRITTEN, f"results could not be written ({error.strerror or error}); make room")
        return fail(BAD_INPUT, str(error))
    except Exception as error:
        if not _no_memory(error):
            raise
        return fail(NOT_WRITTEN, _MEMORY % (str(error) or "it ran out"))
    except KeyboardInterrupt:
        return fail(INTERRUPTED, "interrupted; nothing was written")
    return code or DONE


_MEMORY = "there is too little memory (%s); allow more, or ask for fewer elements"


def _no_memory(error: BaseException) -> bool:
    from ..memory import ran_out

    return ran_out(error)
