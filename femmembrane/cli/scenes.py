"""``femmembrane scenes`` and ``femmembrane new``: scene files to start from."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import InputError
from .outcome import DONE, say, succeed

#: the source tree, if the package is run from one: its scenes are among the demos
_TREE = Path(__file__).parents[2]

TEMPLATE = """\
# A scene: what exists and what is asked of it. Lengths are in units of the radius of the rim, stresses in units of the shear
# modulus. Only what stands here is built and computed; remove the # before a line to ask for it.
title = "{title}"
# With units = "si" here, numbers are in m, m^3, Pa, ...; "5 kPa" and "20 mm" are understood in any case. Both need [scales].

# [scales]
# radius = "25 mm"
# thickness = "0.3 mm"
# shear_modulus = "0.4 MPa"

[material]
model = "neo-hookean"
# model = "ogden"                      # in place of the line above
# mu = [1.4910, 0.0029, -0.0236]
# alpha = [1.3, 5.0, -2.0]

# [membrane]
# susceptibility = 2.5                 # needed with a source

# [[source]]                           # one such table for each
# kind = "dipole"
# strength = 200                       # mu0 D^2/(R0^6 mu)
# height = 6.5                         # above the rim; negative below

[mesh]
shape = "disc"
elements = 64                          # or accuracy = 1e-6 in place of elements and degree
degree = 2

# [effects]
# tension_field = true                 # wrinkles in place of compression
# or bending = true                    # verdicts with bending stiffness: how many wrinkles; needs membrane.radius_to_thickness

[run]
control = "volume"                     # or "pressure", "height"; "arc-length" takes start (a volume) and until
start = 0.5
stop = 20.0
steps = 40

[analysis]
stability = ["pressure", "volume"]     # under which controls
# azimuthal_modes = [1, 2]             # waves around the axis; "all" for the worst number
# wrinkling = "total"                  # zones by the total or the "mechanical" stresses
# error_estimates = true
"""


def scenes() -> int:
    """List the scenes that come with the package; femmembrane run takes their names."""
    import tomllib

    found = bundled()
    width = max((len(name) for name in found), default=0)
    for name, path in found.items():
        title = tomllib.loads(path.read_text(encoding="utf-8")).get("title", "")
        say(f"{name:<{width}}  {title}\n")
    return DONE


def new(name: str, /) -> int:
    """Write a scene file with comments to start from.

    Parameters
    ----------
    name
        Of the scene; the file is NAME.toml.
    """
    path = Path(name if name.endswith(".toml") else f"{name}.toml")
    title = re.sub(r"[\W_]+", " ", path.stem).strip().capitalize()
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(TEMPLATE.format(title=title))
    except FileExistsError:
        raise InputError("name", name, f"{path} is there already; another name is allowed") from None
    except (OSError, ValueError) as error:
        reason = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        raise InputError("name", name, f"{path} cannot be written ({reason})") from None
    return succeed("", [path], hint=f"Next: femmembrane run {path} --out out")


def bundled() -> dict[str, Path]:
    """The scenes that come with the package, by name: from the source tree, or as they were installed."""
    if (_TREE / "pyproject.toml").is_file():
        found = list((_TREE / "demos").glob("*.toml"))
    else:
        from importlib import metadata

        found = [Path(str(file.locate())) for file in metadata.files("femmembrane") or () if file.match("femmembrane/scenes/*.toml")]
    return {path.stem: path for path in sorted(found, key=lambda path: path.stem)}
