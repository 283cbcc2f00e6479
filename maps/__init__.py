"""Maps that come with joulepath: catalogue.toml lists them, fixed/ holds the drawn ones.

Open one by name with `planner.terrain.catalogue.open_map`.
"""
