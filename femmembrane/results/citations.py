"""What to cite for a computation: BibTeX of the equations, methods and libraries that it used, and of nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError
from ..origin import package_version

if TYPE_CHECKING:
    from .branch import Branch

_ENTRIES = {
    "saxena2019": """@article{saxena2019,
  author  = {Saxena, P. and Reddy, N. H. and Pradhan, S. P.},
  title   = {Magnetoelastic deformation of a circular membrane: wrinkling and limit point instabilities},
  journal = {International Journal of Non-Linear Mechanics},
  volume  = {116},
  year    = {2019},
}""",
    "skfem2020": """@article{skfem2020,
  author  = {Gustafsson, Tom and McBain, G. D.},
  title   = {scikit-fem: A {Python} package for finite element assembly},
  journal = {Journal of Open Source Software},
  volume  = {5},
  number  = {52},
  pages   = {2369},
  year    = {2020},
  doi     = {10.21105/joss.02369},
}""",
    "casadi2019": """@article{casadi2019,
  author  = {Andersson, Joel A. E. and Gillis, Joris and Horn, Greg and Rawlings, James B. and Diehl, Moritz},
  title   = {{CasADi}: a software framework for nonlinear optimization and optimal control},
  journal = {Mathematical Programming Computation},
  volume  = {11},
  pages   = {1--36},
  year    = {2019},
  doi     = {10.1007/s12532-018-0139-4},
}""",
    "ipopt2006": """@article{ipopt2006,
  author  = {W{\\"a}chter, Andreas and Biegler, Lorenz T.},
  title   = {On the implementation of an interior-point filter line-search algorithm for large-scale nonlinear programming},
  journal = {Mathematical Programming},
  volume  = {106},
  pages   = {25--57},
  year    = {2006},
  doi     = {10.1007/s10107-004-0559-y},
}""",
    "pipkin1986": """@article{pipkin1986,
  author  = {Pipkin, Allen C.},
  title   = {The relaxed energy density for isotropic elastic membranes},
  journal = {IMA Journal of Applied Mathematics},
  volume  = {36},
  pages   = {85--99},
  year    = {1986},
  doi     = {10.1093/imamat/36.1.85},
}""",
    "steigmann1990": """@article{steigmann1990,
  author  = {Steigmann, David J.},
  title   = {Tension-field theory},
  journal = {Proceedings of the Royal Society of London A},
  volume  = {429},
  pages   = {141--173},
  year    = {1990},
  doi     = {10.1098/rspa.1990.0055},
}""",
}
#: what any computation uses: its equations, its space, its derivatives
_ALWAYS = ("saxena2019", "skfem2020", "casadi2019")
_TENSION_FIELD = ("pipkin1986", "steigmann1990")


def cite(branch: Branch | None = None) -> str:
    """BibTeX entries of what a branch used: the paper, scikit-fem and CasADi; IPOPT and tension-field theory only if it did.

    Parameters
    ----------
    branch : Branch, optional
        Default: what any computation uses.

    Raises
    ------
    InputError
        For something that is no branch.
    """
    keys = [*_ALWAYS]
    if branch is not None:
        if not hasattr(branch, "solver"):
            raise InputError("branch", branch, "a Branch is allowed")
        keys += ["ipopt2006"] if branch.solver == "ipopt" else []
        keys += _TENSION_FIELD if branch.scene.tension_field else ()
    own = ["@software{femmembrane,", "  title   = {femmembrane},", f"  version = {{{package_version()}}},", "}"]
    return "\n\n".join(["\n".join(own), *(_ENTRIES[key] for key in keys)])
