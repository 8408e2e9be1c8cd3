"""The total potential of a scene on its finite-element space, with exact derivatives; CasADi stays in here.

- :mod:`.expressions`: the densities at a point, as CasADi expressions of the terms that the scene has
- :mod:`.magnetic`: energies of magnetised sheets that are more than those of a weak field
- :mod:`.replay`: the instructions of such a function, on whole vectors of points
- :mod:`.point_terms`: what these terms answer at single points
- :mod:`.potential`: their integrals over the membrane
- :mod:`.evaluation`: values, derivatives and Newton steps at a state
- :mod:`.of_scene`: the potential of a scene, built once
- :mod:`.family`: the potential of scenes that differ in one number
- :mod:`.contact`: the potential before rigid bodies
- :mod:`.contact_family`: that of scenes before bodies that differ in one number
- :mod:`.numbered`: the potential of scenes that differ in several numbers
- :mod:`.strain_energy`: strain energies of one's own
"""

from ..kernels.interface import Array as Array
from .contact_family import ContactFamily as ContactFamily
from .evaluation import Evaluation as Evaluation
from .family import Family as Family
from .family import FoldDerivatives as FoldDerivatives
from .numbered import NumberDerivatives as NumberDerivatives
from .numbered import Numbered as Numbered
from .of_scene import potential_of as potential_of
from .potential import Potential as Potential
from .strain_energy import StrainEnergy as StrainEnergy
