"""Parts of the virtual robot: chassis, hidden effects, equations of motion, profiles, sensors."""
