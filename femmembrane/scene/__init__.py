"""What exists and what is asked of it: the scene, its tables in a file, single keys of them, and numbers that vary."""

from .analysis import ALL as ALL
from .analysis import MAX_WAVES as MAX_WAVES
from .analysis import VERDICTS as VERDICTS
from .analysis import WRINKLING as WRINKLING
from .analysis import Analysis as Analysis
from .analysis import Perturbations as Perturbations
from .run import MAX_STEPS as MAX_STEPS
from .run import Run as Run
from .toml import read_tables as read_tables
from .value import MAX_DEGREE as MAX_DEGREE
from .value import MAX_TEXT as MAX_TEXT
from .value import Scene as Scene
