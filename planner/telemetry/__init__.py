"""Logs of measured power: how far a model is off, which effect it lacks, and how to adopt it.

    logs, sampling                   reading, and a sample with a stream of all rows
    prediction, estimation           what a model says for a log, and its parameters from it
    terms, other_terms, evidence     what may be missing, and what speaks for it
    holdout, selection, regimes      errors on runs not seen, the choice, where structure is left
    comparison, diagnosis, adoption  the three questions
    pictures                         what a person looks at to believe a diagnosis
    virtual                          a robot to test against

Nothing is imported here: each room is loaded when it is asked for.
"""
