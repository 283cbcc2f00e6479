"""Effects of the catalogue that a model does not have, as candidate terms.

candidate_library lays out their columns, an Term is one way for an effect to act. An Addition adds
an effect to a model, and fit_with fits both.
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
