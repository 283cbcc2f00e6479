"""The endpoints: a module for each group, with its ``router``."""
