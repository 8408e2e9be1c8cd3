"""What exists and what is asked of it: one frozen value, and what its parts must agree on."""

from __future__ import annotations

import dataclasses
import math
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..checks import number, sequence, store, switch, whole
from ..discretization.lift import Lift, lift_of
from ..discretization.meridian import Meridian, disc
from ..discretization.supports import as_support, floats
from ..errors import InputError, unknown_name
from ..memory import SMALL, require
from ..physics.along import Along
from ..physics.chamber import Chamber
from ..physics.electric import Electric
from ..physics.loads import Load, on_hubs
from ..physics.magnetics import Source, components
from ..physics.materials import Material
from ..physics.named import material_data
from ..physics.obstacles import Obstacle
from ..physics.scales import AGREEMENT, Scales
from .analysis import Analysis
from .bodies import check_obstacles
from .magnetisation import checked_magnetisation, refuse_magnetisation
from .own import parts_from
from .run import GAS, Run
from .toml import item_path, read_tables, scene_arguments, tables_of
from .variation import names

if TYPE_CHECKING:
    from ..quantities import Converter

MAX_DEGREE = 8
#: largest pre-stretch: its sixth power is still a number beside 1
MAX_STRETCH = 1e6
#: characters of a title
MAX_TEXT = 1000
#: bytes that a computation takes for each element and degree at least, measured on 20000 elements: by Newton's method, and by IPOPT
_BYTES, _BYTES_MINIMISED = 5000, 14000
#: bytes that every equilibrium takes beside its state and profiles, and how many numbers these have at a node
_BYTES_STEP, _PROFILES = 2000, 10
_DEGREE = 2
_RADIUS_TO_THICKNESS = 1000.0


@dataclass(frozen=True)
class Scene:
    """A membrane, its surroundings, its mesh and what is asked of it; hashable, never changed once made.

    Parameters
    ----------
    material : Material
        Strain energy: :class:`~femmembrane.physics.materials.Ogden`, ``NeoHookean``, or an object with their methods.
    mesh : Meridian
        Reference meridian and its elements.
    degree : int
        Polynomial degree of the elements, 1 to 8. Left out: 2, or the degree chosen with a mesh for an accuracy (None until then).
    sources : sequence of Source
        Magnetic sources around the axis. Without a source nothing magnetic is built.
    susceptibility : float, optional
        Magnetic susceptibility chi >= 0 of the membrane; required as soon as there is a source, unless there is a remanence.
    radius_to_thickness : float, optional
        R0/T > 0; it enters the total stresses, and bending. Left out: the ratio of the scales, or 1000 without scales.
    tension_field : bool
        Whether the membrane wrinkles rather than carry compression (:mod:`~femmembrane.physics.tension_field`).
    follow_borders : bool or None
        Whether ends of elements follow borders, of contact and of the zones of a tension field: each equilibrium then has as many elements
        as the mesh, some ends of which are at its borders (:attr:`borders`). Left out, those of contact are followed, and those of zones
        are not, as that takes some twenty times as long. Without contact and tension field it does nothing.
    title : str
        Up to 1000 characters.
    run : Run, optional
        Equilibria that :func:`femmembrane.run` computes.
    analysis : Analysis
        Questions asked of every equilibrium.
    scales : Scales, optional
        Physical size and stiffness. Stresses and pressures are then given in Pa as well. They change no equilibrium.
    loads : sequence of Load
        Loads besides the pressure, such as ``Hydrostatic(gamma=...)``. Without a load nothing of loads is built.
    thickness, modulus : float, str, table or callable, optional
        Thickness over T and shear modulus over mu along the meridian, each a factor > 0: a number, an expression such as
        ``"1 - 0.4*R**2"``, a table of (s, factor), or a function of (R, Z, s) (:mod:`~femmembrane.physics.along`). Left out: 1.
    prestretch : float
        How far the membrane is stretched before anything else acts: the rim of a flat disc or annulus is held at so many times its radius,
        the ends of a tube at so many times their height. P, V and lengths stay in units of the reference R0.
    demagnetization : bool
        Whether the sheet feels its own field: the normal flux density is continuous, so that inside H_n = h_n - m_n.
    saturation : float, optional
        mu0 Ms/sqrt(mu mu0) > 0 of the Langevin law. Left out: linear.
    remanence : float, str, table or callable, optional
        Residual magnetisation m_0 >= 0 carried by the sheet, as a flux density in units of sqrt(mu mu0). Along the meridian as for
        ``thickness``, and then of either sign.
    remanence_direction : {"normal", "meridional"}, optional
        Required with a remanence.
    remanence_transport : {"deformed", "rotated"}, optional
        Whether it is carried by the deformation gradient (left out) or by the rotation alone (:mod:`~femmembrane.physics.magnetisation`).
    chamber : Chamber, optional
        The chamber of gas behind the membrane, for runs by amounts of gas and verdicts at a held amount.
    electric : Electric, optional
        A voltage or a charge on the faces of the membrane. Without one nothing electric is built.
    bending : bool
        Whether verdicts count the bending stiffness of the sheet (:mod:`~femmembrane.stability.bending`), which chooses the number of
        waves where the membrane is compressed. Equilibria do not change. It needs a ``radius_to_thickness`` that is given, by itself or by
        scales, and elements of degree 2 or higher.
    obstacles : sequence of Obstacle
        Rigid, axisymmetric, frictionless bodies such as ``Plane(height=0.5)``. Without a body nothing of contact is built.
    squeezed : bool
        Whether obstacles may cut the membrane at rest, as plates that close on a balloon do. Runs over a number of an obstacle set it where
        they come to such scenes; others have no state to start from, and take a ``start``.
    vtu : bool
        Whether a run writes surfaces for ParaView to its folder, most of what is in it. They change no number.
    borders : tuple of (int, float)
        Found with an equilibrium, and not to be given: ends of elements that stand at borders of contact or of zones, by their numbers,
        with their places along the meridian.

    Raises
    ------
    InputError
        For a value that cannot be used, named by its key in a scene file (``mesh.elements``). For scales that contradict
        ``radius_to_thickness`` or a real material, or whose moment no dipole has.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), title="a plain disc")
    >>> scene.degree, scene.mesh.elements
    (2, 16)
    >>> beside = scene.replace(sources=[fm.Dipole(20.0, 2.5)], susceptibility=1.0)  # a scene never changes: this is another one
    >>> for each in (scene, beside):
    ...     print(f"{fm.equilibrium(each, volume=0.8).pressure:.4f}")
    0.7608
    0.0826
    """

    material: Material
    mesh: Meridian = field(default_factory=disc)
    degree: int = None  # type: ignore[assignment]  # an int as soon as the scene has elements
    sources: tuple[Source, ...] = ()
    susceptibility: float | None = None
    radius_to_thickness: float = None  # type: ignore[assignment]  # a float as soon as the scene is made
    tension_field: bool = False
    follow_borders: bool | None = field(default=None, kw_only=True)
    title: str = ""
    run: Run | None = None
    analysis: Analysis = field(default_factory=Analysis)
    scales: Scales | None = None
    loads: tuple[Load, ...] = ()
    thickness: Any = None
    modulus: Any = None
    prestretch: float = 1.0
    demagnetization: bool = False
    saturation: float | None = None
    remanence: Any = None
    remanence_direction: str | None = None
    remanence_transport: str | None = None
    chamber: Chamber | None = None
    electric: Electric | None = None
    bending: bool = False
    #: whether R0/T was given, by itself or by scales
    _thickness_given: ClassVar[bool] = False
    obstacles: tuple[Obstacle, ...] = ()
    squeezed: bool = field(default=False, repr=False)
    vtu: bool = field(default=True, repr=False)
    borders: tuple[tuple[int, float], ...] = field(default=(), repr=False, metadata={"found": True})

    def __post_init__(self) -> None:
        _check_interface("material", self.material, ("energy", "stress"), "a material is allowed, such as Ogden(mu=..., alpha=...)")
        _check_interface(
            "mesh", self.mesh, ("breakpoints", "position", "tangent", "supports"), "a mesh is allowed, such as disc(elements=64)"
        )
        _check_interface("run", self.run, () if self.run is None else ("loads",), "a Run is allowed")
        _check_interface("chamber", self.chamber, () if self.chamber is None else ("volume", "atmosphere"), "a Chamber is allowed")
        _check_interface("analysis", self.analysis, ("stability", "azimuthal_modes", "wrinkling"), "an Analysis is allowed")
        sources = sequence("source", self.sources, "a list of sources is allowed, such as [Dipole(strength=..., height=...)]")
        loads = sequence("load", self.loads, "a list of loads is allowed, such as [Weight(weight=...)]")
        for k, load in enumerate(loads):
            _check_interface(
                item_path("load", k, len(loads)),
                load,
                ("over_reference", "over_projection", "on_hubs", "sees", "acts"),
                "a load is allowed, such as Weight(weight=...)",
            )
        if self.electric is not None:
            _check_interface(
                "electric", self.electric, ("voltage", "plain", "covers"), "an Electric is allowed, such as Electric(voltage=0.3)"
            )
        obstacles = sequence("obstacle", self.obstacles, "a list of obstacles is allowed, such as [Plane(height=0.5)]")
        for k, body in enumerate(obstacles):
            allowed = "an obstacle is allowed, such as Plane(height=0.5)"
            _check_interface(item_path("obstacle", k, len(obstacles)), body, ("pieces", "touch", "facing"), allowed)
        scales = "Scales(radius=..., thickness=..., shear_modulus=...) is allowed"
        _check_interface("scales", self.scales, () if self.scales is None else ("to_si", "fits"), scales)
        bending = switch("effects.bending", self.bending)
        object.__setattr__(self, "_thickness_given", self.radius_to_thickness is not None or self.scales is not None)
        store(
            self,
            bending=bending,
            squeezed=switch("effects.squeezed", self.squeezed),
            vtu=switch("output.vtu", self.vtu),
            degree=_degree("mesh.degree", self.degree, self.open),
            sources=sources,
            loads=loads,
            obstacles=obstacles,
            susceptibility=_susceptibility("membrane.susceptibility", self.susceptibility),
            radius_to_thickness=_ratio("membrane.radius_to_thickness", self.radius_to_thickness, self.scales),
            tension_field=switch("effects.tension_field", self.tension_field),
            follow_borders=None if self.follow_borders is None else switch("mesh.follow_borders", self.follow_borders),
            title=_text("title", self.title),
            thickness=Along.of("membrane.thickness", self.thickness),
            modulus=Along.of("membrane.modulus", self.modulus),
            prestretch=_prestretch("membrane.prestretch", self.prestretch),
            **checked_magnetisation(self),
        )
        if self.tension_field and getattr(self.material, "prestressed", False):
            allowed = "false is allowed with a pre-stressed strain energy: its width without stress is not known"
            raise InputError("effects.tension_field", True, allowed)
        self._check_bending()
        self._check_size()
        self._check_sheet()
        lift = lift_of(self.mesh, self.prestretch)  # refuses what cannot be stretched
        self._check_electric()
        self._check_sources(lift)
        self._check_hubs()
        self._check_run()
        if self.bodies:
            check_obstacles(self, lift)

    def _check_run(self) -> None:
        """A run over a number has that number, and gas has its chamber."""
        run = self.run
        if run is not None and isinstance(number := getattr(run, "number", None), str) and number not in (known := names(self)):
            raise unknown_name("run.over" if run.over else "run.control", number, known or ["(this scene has no number to vary)"])
        gas = run is not None and (run.control == GAS or GAS in (run.hold or ()) or GAS in (run.until or ()))
        if self.chamber is None and (gas or GAS in self.analysis.stability):
            raise InputError("chamber", None, "missing; an amount of gas needs the volume of its chamber: give chamber.volume")

    def _check_bending(self) -> None:
        """Bending has the thickness it follows from, second derivatives, and a compression to act on."""
        if not self.bending:
            return
        if not self._thickness_given:
            message = "missing; bending follows from the thickness: give R0/T, or scales"
            raise InputError("membrane.radius_to_thickness", None, message)
        if self.tension_field:
            allowed = "false is allowed with a tension field, which carries no compression that bending could resist"
            raise InputError("effects.bending", True, allowed)
        if not self.open and self.degree < 2:
            raise InputError("mesh.degree", self.degree, "2 or more is allowed with bending: linear elements have no second derivatives")

    def _check_size(self) -> None:
        """Refuse a scene that the memory has no room for, before anything is built."""
        if self.open:
            return
        count, degree = self.mesh.elements, self.degree
        run = self.run
        minimised = run is not None and run.minimised
        each = degree * (_BYTES_MINIMISED if minimised else _BYTES)
        if count * each > SMALL:
            require("mesh.elements", count, each, f"elements of degree {degree}")
        steps = 0 if run is None else len(run.values or ()) or run.steps or 0
        kept = 8 * (_PROFILES + 2) * count * degree + _BYTES_STEP
        if steps * kept > SMALL:
            require("run.steps" if run is not None and run.values is None else "run.values", steps, kept, "equilibria on this mesh")

    def _check_sheet(self) -> None:
        if self.thickness is None and self.modulus is None:
            return
        ends = self.mesh.breakpoints()
        s = np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2]))
        for key in ("thickness", "modulus"):
            factor = getattr(self, key)
            if factor is not None:
                factor.checked(f"membrane.{key}", *self.mesh.position(s), s)

    def _check_electric(self) -> None:
        if self.electric is not None:
            self.electric.plain(self.scales)  # refuses units without scales
            ends = self.mesh.breakpoints()
            self.electric.check(float(ends[0]), float(ends[-1]))
            if hasattr(self.material, "volume_ratio") and not hasattr(self.material, "electrified"):
                allowed = (
                    "a compressible material is allowed with a voltage or a charge if it says how the field changes its thickness, in a "
                    "method `electrified` as that of Hooke; an incompressible one needs none"
                )
                raise InputError("material.kind", type(self.material).__name__, allowed)

    def _check_sources(self, lift: Lift | None) -> None:
        ends = self.mesh.breakpoints()
        s = np.interp(np.arange(4 * len(ends) - 3) / 4, np.arange(len(ends)), ends) if self.sources else ends  # elements may be curved
        R, Z = self.mesh.position(s)
        if lift is not None:
            R, Z = R + lift.at(self.mesh, s)[0], Z + lift.at(self.mesh, s)[2]
        for k, source in enumerate(self.sources):
            path = item_path("source", k, len(self.sources))
            allowed = "a source is allowed, such as Dipole(strength=..., height=...), or an object of a class derived from Source"
            _check_interface(path, source, ("field", "jet", "intensity", "distance_squared", "passed", "meets", "sees", "refusal"), allowed)
            # a meridian meets the axis at its ends only, so that its breakpoints are enough; circles and bodies may lie between them
            with np.errstate(all="ignore"):
                finite = all(np.all(np.isfinite(component)) for component in components(source, R, Z))
            touched = source.meets(R, Z)
            if touched or not finite:
                name, reason = source.refusal
                if not touched and _too_far(source):
                    reason = "the source is too far away for its field to be a number; move it"
                raise InputError(f"{path}.{name}", getattr(source, name, source), reason)
        refuse_magnetisation(self)
        if self.sources and self.susceptibility is None and self.remanence is None:
            raise InputError(
                "membrane.susceptibility", None, "missing; there is a source, so give membrane.susceptibility (2.5 in the paper)"
            )
        if self.scales is not None and not self.scales.fits(self.sources):
            raise InputError(
                "scales.dipole_moment",
                self.scales.dipole_moment,
                f"no dipole of the scene has its strength, {self.scales.strength:.12g}, so it would do nothing; leave it out, or give a "
                "dipole this strength (in a scene file: leave the strength of the dipole out)",
            )
        _check_shear_modulus(self.material, self.scales)

    def _check_hubs(self) -> None:
        """Every force on a hub has its hub, and is held."""
        supports = [as_support(held) for held in self.mesh.supports()]
        forces = on_hubs(self.loads, [end.rigid for end in supports])
        if floats(supports) and sum(forces) and not any("along" in load.sees for load in self.loads if load.acts):
            advice = "nothing holds the membrane against it along the axis; hold an end, or let the forces on its two hubs add up to 0"
            raise InputError("load.force", sum(forces), advice)

    @property
    def open(self) -> bool:
        """Whether the elements are still to be chosen, for the accuracy that is asked for: nothing can be computed before."""
        return bool(getattr(self.mesh, "open", False))

    @property
    def follows(self) -> bool:
        """Whether the scene has borders that ends of elements can follow, of contact or of zones."""
        return bool(self.bodies) or self.follows_zones

    @property
    def follows_zones(self) -> bool:
        """Whether elements follow the borders of zones."""
        return bool(self.follow_borders) and self.tension_field

    @property
    def bodies(self) -> tuple[Obstacle, ...]:
        """What the membrane cannot enter: the obstacles, and the bodies of sources that bring theirs."""
        own = (getattr(source, "obstacle", None) for source in self.sources)
        return (*self.obstacles, *(body for body in own if body is not None))

    @property
    def element_ends(self) -> tuple[float, ...]:
        """Places along the meridian where elements end beside those of the mesh: jumps and kinks of the sheet, and ends of electrodes."""
        factors = (self.thickness, self.modulus, self.remanence)
        places = {s for factor in factors if isinstance(factor, Along) for s in factor.ends}
        if self.electric is not None:  # with a number of 0 too: it may be one of a family
            places |= {*self.electric.ends} - {*self.mesh.breakpoints()[[0, -1]]}
        return tuple(sorted(places))

    @property
    def converter(self) -> Converter | None:
        """What turns its numbers into SI units: its scales, with the permittivity of its electrodes; None without scales."""
        if self.electric is None:
            return self.scales
        found: Converter | None = self.electric.converter(self.scales)
        return found

    @property
    def electricity(self) -> Electric | None:
        """Voltage or charge without units; None where there is none, or its number is 0."""
        if self.electric is None:
            return None
        plain = self.electric.plain(self.scales)
        if not getattr(plain, plain.load):
            return None
        if not plain.ends:
            return plain
        ends = self.mesh.breakpoints()[[0, -1]]
        return dataclasses.replace(
            plain, start=None if plain.start == ends[0] else plain.start, stop=None if plain.stop == ends[1] else plain.stop
        )

    def bordered(self, borders: tuple[tuple[int, float], ...]) -> Self:
        """The same scene with some ends of its elements where contact begins or ends: a solver finds them, and nothing is checked.

        Parameters
        ----------
        borders : tuple of (int, float)
            Numbers of ends of elements, and their places along the meridian.
        """
        if borders == self.borders:
            return self
        made = object.__new__(type(self))
        made.__dict__.update(self.__dict__, borders=borders)
        return made

    def replace(self, **changes: Any) -> Self:
        """The same scene with some attributes changed, checked anew.

        With new scales ``radius_to_thickness`` follows them. A mesh that is still to be chosen drops the degree.

        Parameters
        ----------
        **changes
            Attributes of the scene and their new values.

        Raises
        ------
        InputError
            For an attribute that a scene does not have, and as for a new scene.
        """
        known = [f.name for f in fields(self)]
        for name, value in changes.items():
            if name not in known:
                raise InputError(name, value, unknown_name(name, name, known).allowed)
        if changes.get("scales") is not None or not self._thickness_given:  # a default is nothing that bending may follow from
            changes.setdefault("radius_to_thickness", None)
        if changes.keys() & {"mesh", "degree", "thickness", "modulus", "remanence", "obstacles", "sources"}:
            changes.setdefault("borders", ())
        if getattr(changes.get("mesh"), "open", False):
            changes.setdefault("degree", None)
        return dataclasses.replace(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        """The scene as nested dictionaries of plain values: the tables of a scene file.

        Raises
        ------
        InputError
            When a material, source or mesh has no name in scene files.
        """
        return tables_of(self)

    def record(self) -> dict[str, Any]:
        """The tables of :meth:`to_dict` for the record of a run; a part without a form in scene files has its class and a note there."""
        return tables_of(self, record=True)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: str | PathLike[str] = ".", own: bool | Scene = False) -> Self:
        """The scene that the tables of a scene file describe.

        Parameters
        ----------
        data : mapping
            Tables, as :meth:`to_dict` gives them.
        folder : path
            Where the path of a mesh file starts from.
        own : bool or Scene
            Where parts named ``module:Class`` come from: modules that are imported (True, for tables that you trust as you trust a
            program), nowhere (False: they are refused), or a scene that has them.

        Raises
        ------
        InputError
            For an unknown table or key (with the nearest valid name), a missing one, or a value that cannot be used.
        """
        from .given import shown_as_given
        from .laboratory import scaled

        with shown_as_given(data):
            return cls(**scene_arguments(scaled(data), Path(folder), parts_from(own, Path(folder))))

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Read a scene file. A part named ``module:Class`` in it is imported, from the folder of the file or the path of Python.

        Parameters
        ----------
        path : path

        Raises
        ------
        InputError
            When the file cannot be read, is no TOML (with the line), or does not describe a scene.
        """
        return cls.from_dict(read_tables(path), Path(path).parent, own=True)

    def to_toml(self, path: str | PathLike[str]) -> None:
        """Write a scene file that :meth:`from_toml` reads back to an equal scene.

        Parameters
        ----------
        path : path

        Raises
        ------
        InputError
            When a material, source or mesh has no name in scene files, or the file cannot be written.
        """
        import tomli_w

        from ..files import replace_file

        text = tomli_w.dumps(self.to_dict())
        with replace_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")


def _too_far(source: Source) -> bool:
    """Whether a field is not finite because its source lies beyond the range of numbers, not because it lies on the membrane."""
    height = getattr(source, "height", 0.0)
    return isinstance(height, float) and abs(height) > 1


def _degree(key: str, value: Any, mesh_open: bool) -> int | None:
    if mesh_open and value is not None:
        raise InputError(key, value, "not allowed together with mesh.accuracy, for which the degree is chosen; leave one out")
    return None if mesh_open else _DEGREE if value is None else whole(key, value, most=MAX_DEGREE)


def _ratio(key: str, value: Any, scales: Scales | None) -> float:
    """R0/T as given, or as it follows from the scales."""
    if value is None:
        return _RADIUS_TO_THICKNESS if scales is None else scales.radius_to_thickness
    ratio = number(key, value, "a finite number > 0 is allowed (R0 over the reference thickness)", above=0)
    if scales is None:
        return ratio
    if not math.isclose(ratio, scales.radius_to_thickness, rel_tol=AGREEMENT):
        follows = f"scales.radius / scales.thickness = {scales.radius_to_thickness:.12g}"
        advice = "leave radius_to_thickness out, and it follows from the scales (Scene.replace does so when it is given other scales)"
        raise InputError(key, value, f"it contradicts {follows}; {advice}")
    return scales.radius_to_thickness


def _check_shear_modulus(material: Any, scales: Any) -> None:
    """Refuse scales that contradict the shear modulus of a real material."""
    name, given = getattr(material, "named", None), getattr(scales, "shear_modulus", None)
    if name is None or given is None:
        return
    own = material_data(name).shear_modulus
    if not math.isclose(given, own, rel_tol=AGREEMENT):
        advice = (
            f"{name} has a shear modulus of {own:.12g} Pa; give that, material_data({name!r}).shear_modulus (a scene file may leave it out)"
        )
        raise InputError("scales.shear_modulus", given, advice)


def _prestretch(key: str, value: Any) -> float:
    return number(key, value, "a finite number > 0 is allowed (1: not stretched)", above=0, most=MAX_STRETCH)


def _susceptibility(key: str, value: Any) -> float | None:
    return None if value is None else number(key, value, "a finite number >= 0 is allowed (2.5 in the paper)", least=0)


def _text(key: str, value: Any) -> str:
    if not isinstance(value, str) or not _encodes(value):
        raise InputError(key, value, "a text (UTF-8) is allowed")
    if len(value) > MAX_TEXT:
        raise InputError(key, value, f"a text of up to {MAX_TEXT} characters is allowed; this one has {len(value)}")
    if not all(c in "\t\n" or unicodedata.category(c) != "Cc" for c in value):
        raise InputError(key, value, "a text without control characters is allowed (tabs and ends of lines are none)")
    return value


def _encodes(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _check_interface(key: str, value: Any, names: tuple[str, ...], allowed: str) -> None:
    # a class in place of its object (NeoHookean for NeoHookean()) has the methods, but nothing to call them on
    if isinstance(value, type) or not all(hasattr(value, name) for name in names):
        raise InputError(key, value, allowed)
