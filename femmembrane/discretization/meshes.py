"""Meshes of the shapes beyond the disc, by functions with the usual arguments in their usual order."""

from __future__ import annotations

from collections.abc import Sequence

from .meridian import Asked
from .shapes import Annulus, Cap, Sphere, Torus, Tube
from .supports import Held


def annulus(
    inner_radius: float,
    elements: int | None = None,
    ratio: float = 1.0,
    inner: Held = "hub",
    outer: Held = "clamped",
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Annulus:
    """Mesh of a flat ring.

    Parameters
    ----------
    inner_radius : float
        Over R0, the outer radius; between 0 and 1.
    elements : int
    ratio : float
        Size of the outermost element over the size of the innermost.
    inner, outer : str or mapping
        How the edges are held, see :mod:`.supports`; a ``hub`` is a rigid disc of the inner radius.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Annulus

    Raises
    ------
    InputError
        As for :class:`Annulus`.

    Examples
    --------
    A force of 1 lifts the hub in the middle of the ring:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.annulus(0.3, elements=16), loads=[fm.HubForce(1.0)])
    >>> round(fm.equilibrium(scene, pressure=0.0).center_height, 4)
    0.4152
    """
    return Annulus(inner_radius=inner_radius, elements=elements, ratio=ratio, inner=inner, outer=outer, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def cap(
    height: float,
    elements: int | None = None,
    ratio: float = 1.0,
    rim: Held = "clamped",
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Cap:
    """Mesh of a spherical cap over a rim of unit radius.

    Parameters
    ----------
    height : float
        Height of the apex over the plane of the rim, in R0; a negative height makes a bowl.
    elements : int
    ratio : float
        Size of the element at the rim over the size of the element at the apex.
    rim : str or mapping
        How the rim is held, see :mod:`.supports`.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Cap

    Raises
    ------
    InputError
        As for :class:`Cap`.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.cap(height=0.5, elements=16))
    >>> eq = fm.equilibrium(scene, volume=1.5)
    >>> print(f"P = {eq.pressure:.4f}, apex at {eq.center_height:.4f}")
    P = 1.1348, apex at 0.7625
    """
    return Cap(height=height, elements=elements, ratio=ratio, rim=rim, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def sphere(
    elements: int | None = None,
    ratio: float = 1.0,
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Sphere:
    """Mesh of a closed sphere of unit radius.

    Parameters
    ----------
    elements : int
    ratio : float
        Size of the element at the lower pole over the size of the element at the upper pole.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Sphere

    Raises
    ------
    InputError
        As for :class:`Sphere`.

    Examples
    --------
    A neo-Hookean balloon of radius l has the pressure 2 (1/l - 1/l^7):

    >>> from math import pi
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(elements=8), degree=4)
    >>> print(f"{fm.equilibrium(scene, volume=4 / 3 * pi * 1.2**3).pressure:.5f}, exact {2 * (1 / 1.2 - 1 / 1.2**7):.5f}")
    1.10850, exact 1.10850
    """
    return Sphere(elements=elements, ratio=ratio, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def cylinder(
    length: float,
    elements: int | None = None,
    ratio: float = 1.0,
    top: Held = "clamped",
    bottom: Held = "clamped",
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Tube:
    """Mesh of a tube of unit radius about the axis.

    Parameters
    ----------
    length : float
        Over R0, the radius.
    elements : int
    ratio : float
        Size of the lowest element over the size of the topmost.
    top, bottom : str
        How the ends are held, see :mod:`.supports`; a ``hub`` is a rigid lid that moves along the axis.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Tube

    Raises
    ------
    InputError
        As for :class:`Tube`.

    Examples
    --------
    A tube with a rigid lid at its top, which the pressure lifts from the height 1:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.cylinder(length=2.0, elements=16, top="hub"))
    >>> eq = fm.equilibrium(scene, volume=8.0)
    >>> print(f"P = {eq.pressure:.4f}, lid at {eq.center_height:.4f}")
    P = 0.5121, lid at 1.0387
    """
    return Tube(length=length, elements=elements, ratio=ratio, top=top, bottom=bottom, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def torus(aspect: float, elements: int | None = None, *, ends: Sequence[float] | None = None, accuracy: Asked | None = None) -> Torus:
    """Mesh of a torus with a round tube of unit radius.

    Parameters
    ----------
    aspect : float
        Radius of the circle through the middle of the tube, over the radius R0 of the tube; > 1.
    elements : int
        Number of elements around the tube, at least 3; equal ones unless ``ends`` says otherwise.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Torus

    Raises
    ------
    InputError
        As for :class:`Torus`.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.torus(aspect=3.0, elements=16))
    >>> print(f"{fm.equilibrium(scene, pressure=0.3).volume:.3f}")
    70.871
    """
    return Torus(aspect=aspect, elements=elements, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there
