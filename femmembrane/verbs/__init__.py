"""What a user asks for: one verb, one frozen result."""

from .convergence import convergence as convergence
from .cost import cost as cost
from .folds import fold_curve as fold_curve
from .follow import equilibrium as equilibrium
from .follow import inflate as inflate
from .follow import pressurize as pressurize
from .follow import run as run
from .follow import vary as vary
from .search import equilibria as equilibria
from .trace import trace as trace
from .trace import trace_iter as trace_iter
