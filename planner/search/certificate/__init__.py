"""Lower bounds on the energy of every motion between two places.

floor = lower_bound(conditions, distance, climb, steepest)   # at once
certify(field, conditions, start, goal, seconds=30.0)        # CertifiedBound, closer
"""

from planner.search.certificate.certified_bound import CertifiedBound, certify
from planner.search.certificate.quick_bound import lower_bound

__all__ = [
    "CertifiedBound",
    "certify",
    "lower_bound",
]
