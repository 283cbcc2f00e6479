"""The power model: what a motion costs on given ground, and which effect takes how much of it.

    effect, kernel_math, effects/    what an effect is, what its formula may use, one file each
    rows, account, kinematics        what the model reads and writes, column by column
    motion_row, limits               rows for a motion on a plane, and the limits that they break
    kernels/                         the active effects as one compiled function
    vehicles/, formulas/, saved/     robots, formulas that users write, saved models
    model                            PowerModel, which most callers need

Nothing is imported here: the files of effects import this package before the catalogue reads them.
"""
