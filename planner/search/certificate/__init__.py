"""Lower bounds on the energy of routes through given places.

floor = lower_bound(conditions, distance, climb, steepest)             # of all motions, at once
floor = legs_bound(field, conditions, [start, via, goal])             # the same along legs
bound = certify(field, conditions, [start, via, goal], seconds=30.0)   # CertifiedBound, closer
"""

from planner.search.certificate.certified_bound import (
    ALL,
    STEADY,
    CertifiedBound,
    certify,
    legs_bound,
)
from planner.search.certificate.quick_bound import lower_bound

__all__ = ["ALL", "STEADY", "CertifiedBound", "certify", "legs_bound", "lower_bound"]
