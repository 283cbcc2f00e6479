"""A small ROUTE.json by hand, for tests that need an answer and no planner."""

from __future__ import annotations

from typing import Any


def route(energy: float, **changes: Any) -> dict[str, Any]:
    """A route of two poses; 40 % of the energy is electronics, 70 % rolling, -10 % gravity."""
    return {
        "energy_j": energy,
        "lower_bound_j": 0.9 * energy,
        "gap": 0.1,
        "duration_s": 20.0,
        "length_m": 10.0,
        "energy_interval_j": [0.9 * energy, 1.1 * energy],
        "breakdown_j": {
            "electronics": 0.4 * energy,
            "wheel_rolling": 0.7 * energy,
            "gravity": -0.1 * energy,
        },
        "battery": {"available_j": 1000.0, "share": energy / 1000.0, "fits": energy <= 1000.0},
        "poses": [
            {"x": 0.0, "y": 0.0, "z": 0.0, "yaw": 0.0, "t": 0.0, "speed": 0.0, "energy_j": 0.0},
            {
                "x": 10.0,
                "y": 0.0,
                "z": 0.0,
                "yaw": 0.0,
                "t": 20.0,
                "speed": 0.0,
                "energy_j": energy,
            },
        ],
        **changes,
    }


def answer(**changes: Any) -> dict[str, Any]:
    """A route of 200 J; the shortest costs 250 J, the fastest the same 200 J."""
    baselines = {
        name: {**route(energy), "extra_share": energy / 200.0 - 1.0}
        for name, energy in (("shortest", 250.0), ("fastest", 200.0))
    }
    for baseline in baselines.values():
        del baseline["poses"]
    return {
        "status": "ok",
        "routes": [route(200.0)],
        "baselines": baselines,
        "planner": {
            "name": "least-energy",
            "space": "plane",
            "objective": "energy",
            "status": "Exact solution",
            "seed": 1,
        },
        "model": {"name": "minibalance", "version": 1, "kind": "sound", "effects": {}},
        "notes": ["defaults taken: contact.roller_viscous = 0 N·s/m"],
        **changes,
    }
