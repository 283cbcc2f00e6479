"""Formulas that users write, made into effects like those of the catalogue.

A formula is read, checked for names and dimensions, and translated; it is never executed.

    tow = custom_effect("tow", "drag * abs(wind_x - vx) * vx", "W",
                        {"drag": {"unit": "kg/s", "bounds": (0, 50), "null": 0}})
"""

from planner.power.formulas.custom import custom_effect, effect_from_definition

__all__ = ["custom_effect", "effect_from_definition"]
