"""stub"""

from planner.telemetry.diagnosis import Experiment


def recommend(examination, selection, log):
    return ()


def what_would_help(slug, why):
    return ""
