"""One equilibrium of a scene: what was computed, and the door to all that may be asked of it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import choice
from ..discretization.meridian import LEAST_LENGTH
from ..errors import InputError, Status
from ..quantities import si_values
from ..scene import ALL, WRINKLING
from ..scene.variation import Parameter
from ..solve.controls import check_height, control_kind
from ..solve.newton import relative_residual
from ..threads import one_thread
from . import door
from .contact import Contact, contact_of

if TYPE_CHECKING:
    from ..potential import Evaluation, Potential
    from ..scene import Scene
    from ..solve.controls import Gas
    from .error_estimate import ErrorEstimate
    from .verdict import Verdict
    from .vibration import Vibration
    from .zones import Zones

Array = NDArray[np.float64]

#: what an answer is remembered under: the kind of question, then what tells two of its kind apart
Key = tuple[Hashable, ...]
T = TypeVar("T")
#: kinds of answers that hold in every scene with the same potential; zones go by stresses, which the scales of a scene enter
_OF_POTENTIAL = ("verdict", "errors", "tangent", "contact")
#: kinds of answers that hold on to the potential
_WITH_POTENTIAL = ("contact",)


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """One equilibrium of a scene, as :func:`femmembrane.equilibrium` and the items of a :class:`Branch` are.

    Attributes
    ----------
    pressure : float
        P = p R0/(mu T).
    volume : float
        Enclosed volume over R0^3, signed, with the 2 pi.
    center_height : float
        Height of the pole over R0. A shape without a pole gives the height of the first point of its meridian.
    elastic_energy, magnetic_energy : float
        In units of mu T R0^2, with the 2 pi; the magnetic one is 0 without sources.
    residual : float
        Largest out-of-balance force at a node, relative to the forces that meet there; recomputed after the solve.
    iterations : int
        Iterations spent on this equilibrium, rejected attempts included.
    status : Status
    scene : Scene
    state : ndarray, shape (n_free,)
        Displacement coefficients of the free degrees of freedom (read-only).
    seconds : float
        Wall time spent on this equilibrium and its verdicts.
    gas : Gas or None
        The enclosed gas that holds it, when found under gas control.
    load_energy : float
        Energy of the loads besides the pressure, in units of mu T R0^2, with the 2 pi; 0 without loads.
    electric_energy : float
        Energy of a voltage (with what its source gives) or of a charge, in the same units; 0 without.
    on_branch : Equilibrium or None
        Of a run over a number whose elements follow zones: the state on the mesh of the branch that was put on its own. None for any other.

    Examples
    --------
    >>> import femmembrane as fm
    >>> eq = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volume=1.0)
    >>> print(f"P = {eq.pressure:.4f}, pole at {eq.center_height:.4f}, {eq.verdict('pressure').word} at a held pressure")
    P = 1.0669, pole at 0.5528, stable at a held pressure
    >>> shape = eq.profile([0.0, 0.5])
    >>> [round(float(eta), 4) for eta in shape["eta"]], [round(float(stretch), 4) for stretch in shape["stretch_1"]]
    ([0.5528, 0.4115], [1.2186, 1.202])
    """

    pressure: float
    volume: float
    center_height: float
    elastic_energy: float
    magnetic_energy: float
    residual: float
    iterations: int
    status: Status
    scene: Scene = field(repr=False)
    state: Array = field(repr=False)
    seconds: float = field(default=0.0, repr=False)
    gas: Gas | None = field(default=None, repr=False)
    load_energy: float = field(default=0.0, repr=False)
    electric_energy: float = field(default=0.0, repr=False)
    on_branch: Equilibrium | None = field(default=None, repr=False)
    _answers: dict[Key, Any] = field(default_factory=dict, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy has: answers that belong to a potential are found anew, as another process builds its own."""
        return {**vars(self), "_answers": {key: answer for key, answer in self._answers.items() if key[0] not in _WITH_POTENTIAL}}

    @property
    def energy(self) -> float:
        """Elastic, magnetic, load and electric energy."""
        return self.elastic_energy + self.magnetic_energy + self.load_energy + self.electric_energy

    @property
    def voltage(self) -> float:
        """phi between the electrodes, the scene's own or Q/C; 0 without, and NaN with a frozen charge, where there is not one voltage."""
        return self._electric["voltage"]

    @property
    def charge(self) -> float:
        """Q on the electrodes over R0^2 sqrt(eps mu); 0 without."""
        return self._electric["charge"]

    @property
    def capacitance(self) -> float:
        """C = Int (lambda_1 lambda_2)^2/t dA of the electrodes over eps R0^2/T, with the 2 pi; 0 without, NaN with a frozen charge."""
        return self._electric["capacitance"]

    @property
    def electric_field(self) -> float:
        """Largest true field at the quadrature points over sqrt(mu/eps); 0 without."""
        return self._electric["electric_field"]

    @property
    def breakdown_ratio(self) -> float:
        """Largest true field over the breakdown field; NaN where the scene gives none."""
        own = self.scene.electric  # where its number is 0, the field is
        breakdown = None if own is None else own.plain(self.scene.scales).breakdown
        return np.nan if breakdown is None else self.electric_field / breakdown

    @property
    def _electric(self) -> dict[str, float]:
        return self.remembered(("electric",), lambda: electric_of(self.scene, self.state))

    @property
    def potential(self) -> Potential:
        """The discrete potential of the scene; it is built once."""
        from ..potential import potential_of

        return potential_of(self.scene)

    @property
    def contact(self) -> Contact | None:
        """Contact with the bodies of the scene, see :class:`~femmembrane.results.contact.Contact`; None where it has none."""
        if not self.scene.bodies:
            return None
        return self.remembered(("contact",), lambda: contact_of(self.potential.evaluate(self.state, self.pressure)))

    def number(self, name: str) -> float:
        """A number of its scene.

        Parameters
        ----------
        name : str
            As :mod:`femmembrane.scene.variation` has it: ``source.0.height``.

        Raises
        ------
        InputError
            For a name that the scene does not have.
        """
        return Parameter(self.scene, name).value

    @property
    def gas_amount(self) -> float:
        """The amount of gas that holds it, in units of mu T R0^2: with the chamber of its scene; NaN without a chamber."""
        chamber = self.scene.chamber
        if chamber is None:
            return float("nan") if self.gas is None else self.gas.amount
        return chamber.amount(self.pressure, self.volume)

    @property
    def of_branch(self) -> Equilibrium:
        """The state on the mesh of its branch: itself, unless its elements follow zones."""
        return self if self.on_branch is None else self.on_branch

    def in_scene(self, scene: Scene) -> Equilibrium:
        """The same equilibrium in a scene with the same potential, which may have other scales and other analyses.

        Parameters
        ----------
        scene : Scene
        """
        return replace(self, scene=scene, _answers={key: answer for key, answer in self._answers.items() if key[0] in _OF_POTENTIAL})

    def remembered(self, key: Key, find: Callable[[], T]) -> T:
        """The answer to a question, which is asked once and remembered.

        Parameters
        ----------
        key : tuple
            The kind of question, then what tells two of its kind apart.
        find : callable
            Who answers.
        """
        if key not in self._answers:
            self._answers[key] = find()
        answer: T = self._answers[key]
        return answer

    def remember(self, key: Key, answer: Any) -> None:
        """Take an answer that was found before, such as one that stood in a file.

        Parameters
        ----------
        key : tuple
            As in :meth:`remembered`.
        answer : object
        """
        self._answers[key] = answer

    def profile(self, r: ArrayLike | None = None) -> dict[str, Array]:
        """The deformed meridian with stretches and stresses.

        Parameters
        ----------
        r : array_like, optional
            Reference radii in [0, 1]. For a meridian that does not run along the radius: arc lengths over R0 from its first end. Default:
            the nodes, from the first end (the pole) to the last (the rim).

        Returns
        -------
        dict of ndarray
            r, rho, eta over R0, and s, the arc length, where it is not r; stretch_1 (meridional) and stretch_2 (circumferential); the
            Cauchy stresses mechanical_stress_1, mechanical_stress_2, total_stress_1 and total_stress_2, in units of mu. A scene with scales
            has the stresses in Pa as well, under the same names with ``_pa`` at the end.

        Raises
        ------
        InputError
            For radii outside the membrane.
        """
        s = self.places(r)
        columns = door.profile_at(self.scene, self.state, self.pressure, s).columns(self.scene.converter)
        if (contact := self.contact) is not None:
            of_contact = {"gap": contact.gap(s), "contact_pressure": contact.pressure(s)}
            columns |= of_contact if self.scene.scales is None else of_contact | si_values(of_contact, self.scene.scales)
        return columns

    def places(self, r: ArrayLike | None = None) -> Array:
        """Parameters of the meridian at reference radii, see :meth:`profile`.

        Parameters
        ----------
        r : array_like, optional
            Default: the nodes.
        """
        space = self.potential.space
        return space.node_parameters() if r is None else _places(r, space.ends, "reference radii" if space.radial else "arc lengths")

    def verdict(
        self, control: str | None = None, *, azimuthal: int | str = 0, gas: Gas | None = None, electric: str | None = None
    ) -> Verdict:
        """Stability against one class of perturbations; computed once and remembered.

        Parameters
        ----------
        control : {"pressure", "volume", "gas"}
            What is held against axisymmetric perturbations. Left out for azimuthal perturbations, which do not change the volume.
        azimuthal : int or "all"
            Number of waves around the axis; 0 for axisymmetric perturbations. With "all" the number whose smallest eigenvalue is the
            lowest is looked for among all that can matter (``femmembrane.stability.worst_waves``); it is the ``azimuthal`` of the verdict.
        gas : Gas, optional
            For control "gas": the enclosed gas. Default: the gas under which this equilibrium was found, or the amount in the chamber of
            the scene that holds it.
        electric : {"voltage", "charge"}, optional
            What is held of the electrodes: the voltage, or the total charge, which stiffens axisymmetric perturbations. Default: what the
            scene gives.

        Raises
        ------
        InputError
            For an unknown control, or for arguments that do not go together.
        """
        key: Key = ("verdict", control, azimuthal) if gas is None else ("verdict", control, azimuthal, gas)
        named = control is None or isinstance(control, str)
        if electric is None and named and isinstance(azimuthal, (int, str)) and key in self._answers:
            known: Verdict = self._answers[key]
            return known
        counted = isinstance(azimuthal, (int, np.integer)) or (isinstance(azimuthal, str) and azimuthal == ALL)
        if not named or not counted:
            raise InputError(
                "control" if counted else "azimuthal", control or azimuthal, 'a name and a number are allowed, or azimuthal="all"'
            )
        if gas is not None and control != "gas":
            raise InputError("gas", gas, 'allowed with control "gas" only')
        if control == "gas" and gas is None:
            gas = self.enclosed
        if electric is None:
            return self.remembered(key, lambda: self._judged(self.potential, control, azimuthal, gas))
        potential = self._holding(electric)
        key = key if potential is self.potential else (*key, electric)
        return self.remembered(key, lambda: self._judged(potential, control, azimuthal, gas))

    def _holding(self, electric: str) -> Potential:
        """The potential with the same forces in this state that holds the voltage, or the total charge."""
        from ..potential import potential_of

        choice("electric", electric, ("voltage", "charge"))
        own = self.scene.electricity
        if own is None or own.frozen_charge is not None:
            raise InputError("electric", electric, "allowed with electrodes that have a voltage or a total charge")
        name, number = ("voltage", self.voltage) if electric == "voltage" else ("total_charge", self.charge)
        if own.load == name:
            return self.potential
        return potential_of(self.scene.replace(electric=replace(own, **{own.load: None, name: number})))

    @property
    def enclosed(self) -> Gas | None:
        """The gas under which it was found, or that in the chamber of its scene which holds it; None without a chamber, or where no amount
        of gas holds it."""
        chamber = self.scene.chamber
        if self.gas is not None or chamber is None:
            return self.gas
        amount = chamber.amount(self.pressure, self.volume)
        return door.gas(amount, chamber.volume, chamber.atmosphere) if amount > 0 and self.volume > -chamber.volume else None

    @one_thread
    def _judged(self, potential: Potential, control: str | None, azimuthal: int | str, gas: Gas | None) -> Verdict:
        evaluation = potential.evaluate(self.state, self.pressure)
        compliance = gas.compliance(self.volume) if gas else None
        return door.checked_verdict()(potential, self.state, self.pressure, evaluation, control, azimuthal, compliance=compliance)

    @one_thread
    def frequencies(self, *, azimuthal: int = 0, count: int = 3, control: str = "pressure") -> tuple[Vibration, ...]:
        """The lowest natural modes, in order of their eigenvalues and proved to be the lowest.

        Parameters
        ----------
        azimuthal : int
            Number of waves around the axis; 0 for axisymmetric modes.
        count : int
            How many modes.
        control : {"pressure", "volume"}
            What is held during the motion. It makes a difference for axisymmetric modes only.

        Raises
        ------
        InputError
            For an argument that is not allowed.
        SolveError
            Where a compressive stress leaves the spectrum without a lowest eigenvalue.
        """
        return door.natural_frequencies(self.potential, self.state, self.pressure, azimuthal, count, control)

    def zones(self, criterion: str | None = None) -> Zones:
        """Taut and wrinkled zones by the signs of the principal stresses, from the pole to the rim; computed once and remembered.

        Zones thinner than about a tenth of an element may be missed.

        Parameters
        ----------
        criterion : {"total", "mechanical"}, optional
            The stresses that decide. Default: ``analysis.wrinkling`` of the scene, or "total".

        Raises
        ------
        InputError
            For an unknown criterion.
        """
        criterion = choice("criterion", self.scene.analysis.zone_criterion if criterion is None else criterion, WRINKLING)
        return self.remembered(("zones", criterion), lambda: door.find_zones(self.scene, self.state, self.pressure, criterion))

    @one_thread
    def on_borders(self, control: str = "volume") -> Equilibrium:
        """The same equilibrium of a tension field on elements that end where its zones of wrinkles begin and end.

        A border of a zone inside an element costs digits at any degree. The ends of elements nearest to the borders are moved there, as
        many elements as before, and the equilibrium is corrected at the same load until both are at rest. Errors then fall at order 2 p
        for elements of degree p, those of the borders as well. ``scene.borders`` of what is returned has the ends that were moved, and
        ``scene.follow_borders`` is true. Where there is no border it is this equilibrium.

        Parameters
        ----------
        control : {"volume", "pressure", "center_height"}
            What is held.

        Raises
        ------
        InputError
            For a scene without a tension field, for an unknown control, and for a mesh with fewer elements than zones.
        SolveError
            For a slack membrane, and where the equilibrium is lost on the way, as next to a fold of what is held.

        Examples
        --------
        >>> import femmembrane as fm
        >>> ogden = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
        >>> beside = {"sources": [fm.Dipole(strength=400.0, height=-3.75)], "susceptibility": 2.5, "tension_field": True}
        >>> eq = fm.equilibrium(fm.Scene(material=ogden, mesh=fm.disc(16), degree=4, **beside), center_height=-0.3)
        >>> borders = eq.on_borders().zones("mechanical").borders
        >>> print(", ".join(f"{r:.6f}" for r in borders))
        0.213730, 0.611444
        """
        kind = control_kind(control)
        held = kind.at(kind.value(self.potential.space, self.state, self.pressure, self.volume))
        return self.remembered(("on_borders", kind.name), lambda: door.on_borders(self, held))

    @one_thread
    def error_estimate(self, control: str = "volume") -> ErrorEstimate:
        """Estimated discretisation errors, from the same load in a finer space; computed once and remembered.

        Some states have no estimate: compressed and slack ones, states too close to a fold in what is held, states on a mesh too coarse.
        Their errors are NaN, and the record says why. In a wrinkled tension field the estimate is rough, a factor of two or so,
        unless every border of a zone is an end of elements (:meth:`on_borders`).

        Parameters
        ----------
        control : {"volume", "pressure", "center_height"}
            What is held. The other quantities are compared at the same volume, pressure or pole height.

        Raises
        ------
        InputError
            For an unknown control.
        """
        held = control_kind(control).name
        if held == "center_height":
            check_height("control", self.potential)

        def estimate() -> ErrorEstimate:
            verdicts = {c: self.verdict(c) for c in ("pressure", "volume")}
            return door.estimate_errors(self.potential, self.state, self.pressure, held, verdicts)

        return self.remembered(("errors", held), estimate)

    @one_thread
    def sensitivity(
        self,
        of: str | Sequence[str] = "pressure",
        to: str | Sequence[str] = (),
        *,
        held: str | None = None,
        r: ArrayLike | None = None,
        control: str | None = None,
        azimuthal: int = 0,
    ) -> Any:
        """Derivatives of what the equilibrium answers with respect to numbers of its scene, while a quantity is held.

        They are exact on the mesh, beyond limit points as well: one back-substitution a number with the factors of the equilibrium.
        Profiles, electric quantities and eigenvalues against waves around the axis are good to about nine digits.

        Parameters
        ----------
        of : str or list of str
            ``pressure``, ``volume``, ``center_height``, ``gas_amount``; ``energy``, ``elastic_energy``, ``magnetic_energy``,
            ``load_energy``, ``electric_energy``; ``voltage``, ``charge``, ``capacitance``, ``electric_field``; ``eigenvalue``, the smallest
            one; columns of :meth:`profile`: ``rho``, ``eta``, ``stretch_1``, ``total_stress_2``, ...; on a body ``contact_radius``,
            ``contact_reference_radius``, ``contact_force``, ``contact_area``. Of a scene with scales those with ``_pa``, ``_m``, ... as
            well, while the scales stay.
        to : str or list of str
            Numbers of the scene by the names of :mod:`femmembrane.scene.variation`, such as ``material.ratio`` or ``source.0.height``.
            Numbers that go with one, as other moduli of Ogden's material do, go with it here too. Of a scene with scales
            ``scales.thickness`` and ``scales.shear_modulus`` as well, in SI units: SI numbers stay, a held pressure included.
        held : {"pressure", "volume", "center_height", "gas"}, optional
            Default: the gas that it was found with, else what the scene's [run] prescribes, else the volume.
        r : array_like, optional
            Where profiles are wanted, as for :meth:`profile`. Default: the nodes.
        control, azimuthal : as for :meth:`verdict`
            Which eigenvalue.

        Returns
        -------
        float, ndarray or dict
            For one quantity and one number its derivative, an array for a profile. A list of numbers gives a dict by their names, a list of
            quantities one by theirs with such values in it.

        Raises
        ------
        InputError
            For an unknown quantity or number, for a number that is not continuous, and for a multiple eigenvalue.
        SolveError
            At a fold of what is held, where nothing has a derivative, where a body is touched without a force, whose two sides differ,
            and for an interpolated state.

        Notes
        -----
        Beside bodies the nodes that are held stay held, and the borders of contact move (:mod:`femmembrane.solve.beside`). At a border the
        slope of a profile jumps: a place there has the derivative of the element behind it.

        In a tension field that is wrinkled in part, answers on a mesh are smooth by pieces: their slopes change by a little where the
        border of the wrinkles passes a quadrature point.

        Examples
        --------
        >>> import femmembrane as fm
        >>> eq = fm.equilibrium(fm.Scene(material=fm.MooneyRivlin(0.1), mesh=fm.disc(16)), center_height=1.0)
        >>> print(f"{eq.sensitivity('pressure', 'material.ratio', held='center_height'):.4f}")
        2.1351
        >>> both = eq.sensitivity(["pressure", "volume"], ["material.ratio", "membrane.prestretch"], held="center_height")
        >>> print(f"{both['volume']['membrane.prestretch']:.4f}")
        2.9464
        """
        from .sensitivities import Along, sensitivity_of

        return sensitivity_of(self, of, to, held, Along(r, control, azimuthal))

    def _repr_html_(self) -> str:
        """The membrane in space with its verdicts, for notebooks; a still picture with numbers where scripts are not allowed."""
        return door.equilibrium_html(self)


def _places(r: ArrayLike, ends: Array, what: str) -> Array:
    allowed = f"{what} in [{ends[0]:g}, {ends[-1]:g}] are allowed"
    try:
        s = np.atleast_1d(np.asarray(r, dtype=float))
    except (TypeError, ValueError):
        raise InputError("r", r, allowed) from None
    margin = LEAST_LENGTH * float(ends[-1])  # a computed end is exact to round-off only
    if s.ndim != 1 or not ((s >= ends[0] - margin) & (s <= ends[-1] + margin)).all():
        raise InputError("r", r, allowed)
    return np.clip(s, ends[0], ends[-1])


def electric_of(scene: Scene, x: Array) -> dict[str, float]:
    """Voltage, charge, capacitance and largest field of a state; electrodes without a voltage or charge have a capacitance as well."""
    from ..potential import potential_of

    own = scene.electric
    if own is None or scene.electricity is not None:
        return potential_of(scene).electric_quantities(x)
    plain = replace(own.plain(scene.scales), **{own.load: 1.0})
    found = potential_of(scene.replace(electric=plain, scales=None)).electric_quantities(x)
    return {**dict.fromkeys(found, 0.0), "capacitance": found["capacitance"]}


def recorded(
    scene: Scene,
    potential: Potential,
    x: Array,
    pressure: float,
    evaluation: Evaluation,
    status: Status,
    residual: float | None = None,
    iterations: int = 0,
    gas: Gas | None = None,
) -> Equilibrium:
    """The record of a state of a scene; its residual is found if it is not given. What is -0 is written as 0."""
    if residual is None:
        force = evaluation.gradient - pressure * evaluation.volume_gradient
        residual = relative_residual(potential, force, evaluation, pressure)
    coefficients = x.copy()
    coefficients.flags.writeable = False
    return Equilibrium(
        pressure=float(pressure) + 0.0,
        volume=evaluation.volume + 0.0,
        center_height=potential.space.center_height(x) + 0.0,
        elastic_energy=evaluation.elastic_energy,
        magnetic_energy=evaluation.magnetic_energy,
        residual=float(residual),
        iterations=iterations,
        status=status,
        scene=scene,
        state=coefficients,
        load_energy=evaluation.load_energy,
        electric_energy=evaluation.electric_energy,
        gas=gas,
    )
