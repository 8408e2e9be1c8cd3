"""Axisymmetric hyperelastic membranes in a magnetic field: equilibria by energy minimisation, and their stability.

The public names are imported when they are first used, so that ``femmembrane --help`` need not wait for the numerics.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .discretization.meridian import Disc as Disc
    from .discretization.meridian import disc as disc
    from .discretization.mesh_files import Curve as Curve
    from .discretization.mesh_files import meridian_from_points as meridian_from_points
    from .discretization.mesh_files import read_meridian as read_meridian
    from .discretization.mesh_files import write_meridian as write_meridian
    from .discretization.shapes import Annulus as Annulus
    from .discretization.shapes import Cap as Cap
    from .discretization.shapes import Cylinder as Cylinder
    from .discretization.shapes import Sphere as Sphere
    from .discretization.shapes import Torus as Torus
    from .discretization.shapes import annulus as annulus
    from .discretization.shapes import cap as cap
    from .discretization.shapes import cylinder as cylinder
    from .discretization.shapes import sphere as sphere
    from .discretization.shapes import torus as torus
    from .errors import FemmembraneError as FemmembraneError
    from .errors import InputError as InputError
    from .errors import SolveError as SolveError
    from .errors import Status as Status
    from .physics.invariant import ArrudaBoyce as ArrudaBoyce
    from .physics.invariant import Fung as Fung
    from .physics.invariant import Gent as Gent
    from .physics.invariant import Yeoh as Yeoh
    from .physics.loads import HubForce as HubForce
    from .physics.loads import Hydrostatic as Hydrostatic
    from .physics.loads import Load as Load
    from .physics.loads import Weight as Weight
    from .physics.magnetics import Dipole as Dipole
    from .physics.magnetics import Source as Source
    from .physics.materials import MooneyRivlin as MooneyRivlin
    from .physics.materials import NeoHookean as NeoHookean
    from .physics.materials import Ogden as Ogden
    from .physics.materials import Varga as Varga
    from .physics.scales import Scales as Scales
    from .physics.sources import Loop as Loop
    from .physics.sources import Solenoid as Solenoid
    from .physics.sources import Uniform as Uniform
    from .physics.sources import Wire as Wire
    from .physics.tabulated import Tabulated as Tabulated
    from .potential import StrainEnergy as StrainEnergy
    from .results.citations import cite as cite
    from .results.convergence import Convergence as Convergence
    from .results.cost import Cost as Cost
    from .results.equilibria import Equilibria as Equilibria
    from .results.error_estimate import Deviation as Deviation
    from .results.error_estimate import ErrorEstimate as ErrorEstimate
    from .results.folds import Cusp as Cusp
    from .results.folds import FoldCurve as FoldCurve
    from .results.records import Branch as Branch
    from .results.records import Equilibrium as Equilibrium
    from .results.records import Jump as Jump
    from .results.records import SpecialPoint as SpecialPoint
    from .results.store import load as load
    from .results.sweep import Sweep as Sweep
    from .results.verdict import Verdict as Verdict
    from .results.vibration import Vibration as Vibration
    from .results.zones import Zone as Zone
    from .results.zones import Zones as Zones
    from .scene import Analysis as Analysis
    from .scene import Run as Run
    from .scene import Scene as Scene
    from .solve.continuation import StepControl as StepControl
    from .solve.controls import Gas as Gas
    from .stability.jacobi import jacobi_test as jacobi_test
    from .stability.jacobi import legendre_test as legendre_test
    from .verbs import equilibria as equilibria
    from .verbs import equilibrium as equilibrium
    from .verbs import fold_curve as fold_curve
    from .verbs import inflate as inflate
    from .verbs import pressurize as pressurize
    from .verbs import run as run
    from .verbs import trace_iter as trace_iter
    from .verbs.convergence import convergence as convergence
    from .verbs.cost import cost as cost
    from .verbs.sweep import plan_sweep as plan_sweep
    from .verbs.sweep import sweep as sweep
    from .verbs.trace import trace as trace
    from .views.export import export as export
    from .views.modes import render_mode as render_mode
    from .views.modes import write_mode_vtk as write_mode_vtk
    from .views.picture import render as render
    from .views.show import view as view

__version__ = "0.1.0"

_ROOMS = {
    "results.convergence": ("Convergence",),
    "results.error_estimate": ("Deviation", "ErrorEstimate"),
    "discretization.meridian": ("Disc", "disc"),
    "discretization.mesh_files": ("Curve", "meridian_from_points", "read_meridian", "write_meridian"),
    "discretization.shapes": (
        *("Annulus", "Cap", "Cylinder", "Sphere", "Torus"),
        *("annulus", "cap", "cylinder", "sphere", "torus"),
    ),
    "errors": ("FemmembraneError", "InputError", "SolveError", "Status"),
    "physics.invariant": ("ArrudaBoyce", "Fung", "Gent", "Yeoh"),
    "physics.loads": ("HubForce", "Hydrostatic", "Load", "Weight"),
    "physics.magnetics": ("Dipole", "Source"),
    "physics.materials": ("MooneyRivlin", "NeoHookean", "Ogden", "Varga"),
    "physics.scales": ("Scales",),
    "physics.sources": ("Loop", "Solenoid", "Uniform", "Wire"),
    "physics.tabulated": ("Tabulated",),
    "potential": ("StrainEnergy",),
    "results.citations": ("cite",),
    "results.records": ("Branch", "Equilibrium", "Jump", "SpecialPoint"),
    "results.store": ("load",),
    "solve.continuation": ("StepControl",),
    "solve.controls": ("Gas",),
    "scene": ("Analysis", "Run", "Scene"),
    "results.vibration": ("Vibration",),
    "stability.jacobi": ("jacobi_test", "legendre_test"),
    "results.verdict": ("Verdict",),
    "results.zones": ("Zone", "Zones"),
    "results.cost": ("Cost",),
    "results.folds": ("Cusp", "FoldCurve"),
    "results.equilibria": ("Equilibria",),
    "results.sweep": ("Sweep",),
    "verbs.sweep": ("plan_sweep", "sweep"),
    "verbs": (
        *(
            "convergence",
            "cost",
            "equilibria",
            "equilibrium",
            "fold_curve",
            "inflate",
            "pressurize",
            "run",
            "trace",
            "trace_iter",
        ),
    ),
    "views.export": ("export",),
    "views.modes": ("render_mode", "write_mode_vtk"),
    "views.picture": ("render",),
    "views.show": ("view",),
}
_HOME = {name: room for room, names in _ROOMS.items() for name in names}

__all__ = ["__version__", *sorted(_HOME)]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .threads import WHOLE

    with WHOLE:  # a process that is forked in the middle of an import could never make it
        value = getattr(importlib.import_module("." + _HOME[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
