# Made by docs/make_types.py from the entry points of capabilities.
from ..capabilities.comparison.study_method import ComparisonResult as ComparisonResult
from ..capabilities.comparison.study_method import compare as _compare
from ..capabilities.identification.study_method import IdentificationResult as IdentificationResult
from ..capabilities.identification.study_method import identify as _identify
from ..capabilities.optimize.study_method import BestResult as BestResult
from ..capabilities.optimize.study_method import optimize as _optimize
from ..capabilities.sweep.study_method import SweepResult as SweepResult
from ..capabilities.sweep.study_method import sweep as _sweep
from ..capabilities.watch.study_method import WatchResult as WatchResult
from ..capabilities.watch.study_method import watch as _watch

__all__ = ["BestResult", "ComparisonResult", "IdentificationResult", "SweepResult", "WatchResult"]

class StudyMethods:
    compare = _compare
    identify = _identify
    optimize = _optimize
    sweep = _sweep
    watch = _watch
