"""Effects taken into a model as a new version.

adopt gives an Adoption with errors before and after and warnings. history lists the versions of a
model, revert brings one back.
"""

from planner.telemetry.adoption.adopt_effects import DIAGNOSED, Adoption, adopt
from planner.telemetry.adoption.versions import history, revert

__all__ = ["DIAGNOSED", "Adoption", "adopt", "history", "revert"]
