"""What a saved model's file holds besides effects and vehicle.

The frame of the file is checked when it is read. A fit adds what it leaves open about energies.
PowerModel.save and PowerModel.load write and read the file.
"""

from planner.power.saved.energy_error import Covered, EnergyError, ParameterCovariance
from planner.power.saved.saved_model import ACCEPTED, SavedModel

__all__ = ["ACCEPTED", "Covered", "EnergyError", "ParameterCovariance", "SavedModel"]
