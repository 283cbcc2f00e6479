"""Name the physical effect that a model lacks, or say why a log does not show it.

diagnose gives a Diagnosis: verdict, candidates with evidence, regimes, and experiments that would
tell more. sampled gives the commands of a recommended drive, fitted_into
makes it fit an area.
"""

from planner.telemetry.diagnosis.advice import fitted_into, sampled
from planner.telemetry.diagnosis.diagnose_log import diagnose, diagnose_source
from planner.telemetry.diagnosis.results import Candidate, Diagnosis, Errors, Experiment

__all__ = [
    "Candidate",
    "Diagnosis",
    "Errors",
    "Experiment",
    "diagnose",
    "diagnose_source",
    "fitted_into",
    "sampled",
]
