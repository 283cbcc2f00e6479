"""What to do where a path cannot be driven, or where limits of torque make its motion expensive.

caution = first_caution(run, field, "energy", patient=True)
attempt = straight_up(run, field, "energy", ANSWER, closely, FIRST)
attempt = or_gentler(run, field, attempt, "energy", ANSWER, SLOPE_MARGINS[1:])
"""
