"""``femmembrane --install-completion``: words that the shell completes."""

from __future__ import annotations

from typing import Literal

from ..errors import InputError
from .outcome import succeed

Shell = Literal["bash", "zsh", "fish", "powershell"]


def install_completion(*, shell: Shell | None = None) -> int:
    """Let the shell complete commands and options: writes a script to its usual place, and a line to its start-up file.

    Parameters
    ----------
    shell
        The one that is running by default.
    """
    from cyclopts.completion.detect import ShellDetectionError, detect_shell

    from . import app

    try:
        script = app.install_completion(shell=shell or detect_shell())
    except ShellDetectionError:
        raise InputError("--shell", None, "the shell was not recognised; bash, zsh, fish and powershell are allowed") from None
    return succeed("", [script], hint="A new shell completes femmembrane.")
