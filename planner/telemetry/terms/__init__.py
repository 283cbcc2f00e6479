"""Effects of the catalogue that a model does not have, as candidate terms.

candidate_library computes their columns. A Term is one form of an effect. An Addition adds an
effect to a model, and fit_with fits both.
"""

from planner.telemetry.terms.augmented_fit import Addition, fit_with, trimmed
from planner.telemetry.terms.candidate_terms import CandidateLibrary, Term, candidate_library

__all__ = [
    "Addition",
    "CandidateLibrary",
    "Term",
    "candidate_library",
    "fit_with",
    "trimmed",
]
