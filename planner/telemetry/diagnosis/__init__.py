"""Which physical effect a model lacks, or why a log cannot tell.

diagnose gives a Diagnosis: verdict, candidates with evidence, regimes, and experiments that would
tell more.
"""

from planner.telemetry.diagnosis.diagnose_log import diagnose, diagnose_source
from planner.telemetry.diagnosis.results import Candidate, Diagnosis, Errors

__all__ = [
    "Candidate",
    "Diagnosis",
    "Errors",
    "diagnose",
    "diagnose_source",
]
