"""Maps that come with joulepath: catalogue.toml lists them, fixed/ holds drawn
ones and relief/ measured ones.

Open one by name with `planner.terrain.catalogue.open_map`.
"""
