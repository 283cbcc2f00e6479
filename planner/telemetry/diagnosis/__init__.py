"""Name the physical effect that a model lacks, or say why a log does not show it.

diagnose gives a Diagnosis: verdict, candidates with evidence, regimes, and experiments that would
tell more.
"""

from planner.telemetry.diagnosis.diagnose_log import diagnose, diagnose_source
from planner.telemetry.diagnosis.results import Candidate, Diagnosis, Errors

__all__ = ["Candidate", "Diagnosis", "Errors", "diagnose", "diagnose_source"]
