"""What is integrated, at one point: CasADi expressions in the local variables (u, u_x, w, w_x).

Only the terms that the scene has are written down::

    E = Int W(e_1, e_2) R dS + [Int -chi/2 |h|^2 R dS] + [loads],       V = Int rho rho_x eta dx,       both with the 2 pi

(where an end is not held in the plane z = 0, V is closed by flat lids, :mod:`..physics.loads`.)
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ..discretization.space import Space
from ..physics.kinematics import hencky_strains
from ..physics.loads import Load, hub_density, lidded_volume_density, over_projection, over_reference, volume_density, wall_density
from ..physics.magnetics import Source, magnetic_energy_density
from ..physics.magnetisation import Magnetisation, remanence_column
from ..physics.response import ELECTRODE, response_of, squared
from ..threads import Guard
from .magnetic import point_energy
from .nearby import Nearby

if TYPE_CHECKING:
    from ..physics.materials import Material
    from ..scene import Scene

#: columns of data that hold the displacement beside which the unknowns count
LIFT = ("lift_u", "lift_u_x", "lift_w", "lift_w_x")
#: and those of what the number of a family adds to it for each unit
MOVE = ("move_u", "move_u_x", "move_w", "move_w_x")
#: held while expressions are built: CasADi has one mode, for all threads, of multiplying symbols
BUILDING = Guard()


@contextmanager
def casadi_answers_numpy() -> Iterator[None]:
    """Let NumPy's ufuncs act on CasADi symbols here without changing the caller's setting; to be used under :data:`BUILDING`."""
    before = ca.GlobalOptions.getNumpyMode()
    ca.GlobalOptions.setNumpyMode(1)
    try:
        yield
    finally:
        ca.GlobalOptions.setNumpyMode(before)


def point_expressions(
    scene: Scene,
    sources: Sequence[Source],
    loads: Sequence[Load],
    columns: Sequence[str],
    space: Space,
    forces: tuple[Any, Any] | None,
) -> tuple[tuple[ca.SX, ca.SX, ca.SX], dict[str, ca.SX]]:
    """Symbols (data, local, parameters) and the weighted densities with their gradients at one point. Quantities without a column of data
    are 0.
    """
    data = ca.SX.sym("data", len(columns))
    local = ca.SX.sym("local", 4)
    charged = scene.electricity is not None and scene.electricity.total_charge is not None
    parameters = ca.SX.sym("parameters", 3 if charged else 2)
    flat = "Z" not in columns
    R, R_x, weight, Z, Z_x = (data[columns.index(c)] if c in columns else ca.SX(0) for c in ("R", "R_x", "weight", "Z", "Z_x"))
    own_w, own_w_x = local[2], local[3]
    way = getattr(scene, "lifted", None)
    shares = (1.0, 0.0 if way is None else way.share)
    u, u_x, w, w_x = (
        sum((share * data[columns.index(name)] for share, name in zip(shares, pair, strict=True) if name in columns), local[k])
        for k, pair in enumerate(zip(LIFT, MOVE, strict=True))
    )
    e1, e2 = hencky_strains(R, R_x, Z_x, u, u_x, w_x)
    area = weight * R * (R_x if flat else np.sqrt(R_x**2 + Z_x**2))
    if "thickness" in columns:
        area = area * data[columns.index("thickness")]  # all that is integrated over it belongs to the bulk of the sheet
    material = response_of(scene, electric_square(scene, data, columns, parameters))
    stress, tangent = response_expressions(material, ca.vertcat(e1, e2))
    modulus = data[columns.index("modulus")] if "modulus" in columns else None
    if modulus is not None:
        stress, tangent = modulus * stress, modulus * tangent
    bulk = area if modulus is None else area * modulus
    # the chain rule through closed-form stresses keeps digits that differentiating the energy would lose at small strain; written out, it
    # takes half the operations
    slopes = ca.jacobian(ca.vertcat(e1, e2), local)
    gradient = area * ca.mtimes(slopes.T, stress)
    bending = sum((stress[k] * ca.jacobian(slopes[k, :].T, local) for k in range(2)), ca.SX(4, 4))
    hessian = area * (ca.mtimes([slopes.T, tangent, slopes]) + bending)
    enclosed = lidded_volume_density(R + u, Z_x + w_x) if space.lids else volume_density(R + u, R_x + u_x, Z + w)
    if "wall" in columns:
        wall, wall_x = (data[columns.index(name)] for name in ("wall", "wall_x"))
        if "move_wall" in columns and way is not None:
            wall = wall + way.wall * data[columns.index("move_wall")]
            wall_x = wall_x + way.wall * data[columns.index("move_wall_x")]
        enclosed = enclosed + wall_density(wall, wall_x, own_w, own_w_x)
    inside = weight if space.side > 0 else -weight
    volume = inside * enclosed
    magnetic = ca.SX(0)
    if sources:
        near = Nearby(sources, R + u, Z + w)
        magnetisation = Magnetisation.of(scene)
        if magnetisation is not None:
            own = "remanence" in columns
            remanence = data[columns.index("remanence")] if own else remanence_column(magnetisation, 0.0, 0.0, 0.0, space.side)
            rates = (R_x if flat else np.sqrt(R_x**2 + Z_x**2)), R
            found = point_energy(magnetisation, near.sources, (R + u, Z + w), (R_x + u_x, Z_x + w_x), rates, remanence, local)
            magnetic, first, second = (area * parameters[1] * part for part in found)
        else:
            magnetic = parameters[1] * (area * magnetic_energy_density(near.sources, scene.susceptibility, R + u, Z + w))
            second, first = ca.hessian(magnetic, local)
        magnetic, first, second = near.placed(magnetic, first, second)
        gradient, hessian = gradient + first, hessian + second
    load = ca.SX(0)
    if loads:
        load = area * over_reference(loads, R + u, Z + w) + inside * (R + u) * (R_x + u_x) * over_projection(loads, Z + w)[0]
        if forces is not None:
            hub, hub_x = (data[columns.index(c)] for c in ("hub", "hub_x"))
            load += weight / (2 * math.pi) * hub_density(forces, hub, hub_x, Z + w, Z_x + w_x)
        load = parameters[1] * load
        second, first = ca.hessian(load, local)
        gradient, hessian = gradient + first, hessian + second
    return (data, local, parameters), {
        "elastic": bulk * material.energy(e1, e2),
        "magnetic": magnetic,
        "load": load,
        **({} if scene.electricity is None else {"electric": bulk * material.electric_energy(e1, e2)}),  # type: ignore[attr-defined]
        "volume": volume,
        "gradient": gradient,
        "hessian": hessian,
        "volume_gradient": ca.gradient(volume, local),
        "stress": stress,
    }


def electric_square(scene: Scene, data: ca.SX, columns: Sequence[str], parameters: ca.SX) -> Any:
    """The local square of voltage or charge, with the factor on sources and loads; None without. With a total charge that of the voltage is
    the third parameter.
    """
    if scene.electricity is None:
        return None
    whole = parameters[2] if scene.electricity.total_charge is not None else parameters[1] * squared(scene.electricity)
    return whole * data[columns.index(ELECTRODE)] if ELECTRODE in columns else whole


def response_expressions(material: Material, strains: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Principal stresses, shape (2, 1), and their derivative with respect to the Hencky strains, shape (2, 2)."""
    e1, e2 = strains[0], strains[1]
    s11, s12, s22 = material.tangent(e1, e2)
    return ca.vertcat(*material.stress(e1, e2)), ca.vertcat(ca.horzcat(s11, s12), ca.horzcat(s12, s22))


def point_rows(symbols: list[ca.SX], rows: list[ca.SX]) -> ca.Function:
    return ca.Function("point_rows", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True})
