"""Origin of a result: which half of the package computed it, on which processor, with which versions. Others give the same answers to
round-off.
"""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from .kernels import kernels

#: distributions whose versions are noted
NOTED_VERSIONS = ("femmembrane", "numpy", "scipy", "scikit-fem", "casadi")


def package_version(name: str = "femmembrane") -> str:
    """Version of an installed distribution, or ``unknown`` (a source tree that was never installed)."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "unknown"


def processor() -> str:
    """Name of the processor where the system tells it (Linux), or its kind."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def origin() -> dict[str, str]:
    """All that the last digits of a result depend on, beside the scene."""
    return {
        "half": kernels().name,
        "processor": processor(),
        "system": f"{platform.system()} {platform.machine()}",
        **{name: package_version(name) for name in NOTED_VERSIONS},
    }


def difference(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """A remark for a computation that was begun elsewhere and goes on here; empty if nothing differs."""
    differing = [name for name in now if before.get(name) != now[name]]
    if not differing:
        return ""
    there, here = (", ".join(f"{name} {facts.get(name, 'unknown')}" for name in differing) for facts in (before, now))
    return f"begun with {there}, resumed with {here}: points may differ by round-off from those of a run that was not interrupted"
