"""Small documents of the workbench by hand, for tests that need results and no diagnosis.

One story: a robot that meets the air. The base model misses 2 W rms, most of it when it drives
fast; air_drag explains it down to the noise of 0.5 W.
"""

from __future__ import annotations

from typing import Any

LOG: dict[str, Any] = {
    "source": "drive.csv",
    "sha256": "ab" * 32,
    "rows": 4000,
    "runs": 2,
    "report": [
        {"kind": "gap", "column": "time", "rows": 3, "sentence": "3 gaps of more than 1 s"},
        {"kind": "format", "column": "", "rows": 0, "sentence": "read as csv with ';'"},
    ],
    "derived": ["ax: d(vx)/dt - wz·vy"],
    "assumed": ["no roll and pitch: the ground is taken as flat"],
}
MODEL: dict[str, Any] = {
    "name": "minibalance",
    "version": 1,
    "kind": "sound",
    "vehicle": "minibalance",
    "parent": None,
    "effects": {"electronics": {"power": 5.0}},
}
REGIMES = [
    {
        "where": "faster than 0.6 m/s",
        "rows": 900,
        "bias_w": 3.1,
        "rmse_w": 3.4,
        "share_of_squared_error": 0.41,
    }
]
PICTURES: dict[str, Any] = {
    "stretch": {
        "run": "b",
        "time_s": [0.5 * k for k in range(12)],
        "measured_w": [10.0] * 6 + [20.0] * 6,
        "predicted_w": [10.0] * 12,
        "proposed_w": [10.0] * 6 + [20.0] * 6,
    },
    "curves": [
        {
            "of": "air_drag",
            "quantity": "speed",
            "x": [0.2, 0.8],
            "missing_w": [0.0, 4.0],
            "stderr_w": [0.1, None],
            "rows": [3100, 900],
            "fitted_w": [0.0, 4.0],
        }
    ],
    "shares": [
        {
            "where": where,
            "rows": rows,
            "share_of_rows": rows / 4000,
            "share_of_squared_error": share,
            "bias_w": bias,
        }
        for where, rows, share, bias in (
            ("faster than 0.6 m/s", 900, 0.41, 3.1),
            ("everywhere else", 3100, 0.59, -0.2),
        )
    ],
}


def comparison(**changes: Any) -> dict[str, Any]:
    """Comparison.to_json()."""
    return {
        "model": MODEL,
        "fitted": True,
        "log": LOG,
        "rmse_w": 2.0,
        "mae_w": 1.5,
        "bias_w": -0.25,
        "r2": 0.95,
        "heldout_rmse_w": 2.1,
        "noise_floor_w": 0.5,
        "energy": {"measured_j": 40000.0, "predicted_j": 39000.0, "error_share": -0.025},
        "runs": [
            {
                "run": run,
                "rows": 2000,
                "measured_j": 20000.0,
                "predicted_j": predicted,
                "error_share": predicted / 20000.0 - 1,
                "rmse_w": 2.0,
                "bias_w": 0.5,
            }
            for run, predicted in (("a", 19000.0), ("b", 20000.0))
        ],
        "regimes": REGIMES,
        **changes,
    }


def candidate(effect: str, probability: float, **changes: Any) -> dict[str, Any]:
    """One entry of a ranking."""
    return {
        "effect": effect,
        "probability": probability,
        "heldout_rmse_w": 0.52,
        "parameters": {"drag_area": {"value": 0.22, "stderr": 0.01, "unit": "m²"}},
        "evidence": {
            "z": 21.5,
            "rho": 0.4,
            "delta_log_likelihood": 230.0,
            "degrees_of_freedom": 1,
            "p_value": 1e-90,
        },
        "indistinguishable_from": [],
        "testable": True,
        "why_not": None,
        **changes,
    }


def diagnosis(**changes: Any) -> dict[str, Any]:
    """Diagnosis.to_json()."""
    return {
        "verdict": "missing_effect",
        "selected": ["air_drag"],
        "sentence": "The model lacks air_drag.",
        "baseline": {"rmse_w": 2.0, "heldout_rmse_w": 2.1, "noise_floor_w": 0.5},
        "after": {"rmse_w": 0.5, "heldout_rmse_w": 0.52},
        "candidates": [
            candidate("air_drag", 0.97),
            candidate("viscous_drag", 0.02, indistinguishable_from=["converter_efficiency"]),
        ],
        "not_testable": [
            {
                "effect": "motor_heating",
                "why": "the log has no motor_temp",
                "what_would_help": "Log motor_temp.",
            },
            *(
                {
                    "effect": effect,
                    "why": f"it would go unnoticed {size}, 3.0 % of the mean power",
                    "what_would_help": f"Look at {effect}.",
                    "cause": "it would go unnoticed",
                    "size": size,
                }
                for effect, size in (("wear", "up to 0.31 W"), ("stiction", "up to 0.12 W"))
            ),
        ],
        "regimes": REGIMES,
        "unexplained": {"heldout_over_floor": 1.07, "where": []},
        "outside_catalogue": None,
        "sensor": None,
        "experiments": [
            {
                "separates": ["viscous_drag", "converter_efficiency"],
                "run": "drive 60 s at 0.2 m/s, then 60 s at 0.8 m/s",
                "settings": {},
            }
        ],
        "log": LOG,
        "model": MODEL,
        "pictures": PICTURES,
        **changes,
    }


def entry(version: int, **changes: Any) -> dict[str, Any]:
    """One entry of a history."""
    return {
        "version": version,
        "parent": f"minibalance v{version - 1}",
        "action": "adopt",
        "adopted": ["air_drag"],
        "effects": {"electronics": {"power": 5.0}},
        "log": {"source": "drive.csv", "sha256": "ab" * 32, "rows": 4000, "runs": 2},
        "before": {"rmse_w": 2.0, "heldout_rmse_w": 2.1},
        "after": {"rmse_w": 0.5, "heldout_rmse_w": 0.52},
        "noise_floor_w": 0.5,
        "warnings": [],
        "at": "2026-03-04T05:06:07+00:00",
        "snapshot": {"custom": [], "surfaces": [], "stderr": None},
        **changes,
    }


def adoption(**changes: Any) -> dict[str, Any]:
    """Adoption.to_json()."""
    return {
        "model": {**MODEL, "version": 2, "parent": "minibalance"},
        "adopted": ["air_drag"],
        "before": {"rmse_w": 2.0, "heldout_rmse_w": 2.1},
        "after": {"rmse_w": 0.5, "heldout_rmse_w": 0.52},
        "noise_floor_w": 0.5,
        "warnings": [],
        "parameters": [
            {
                "effect": "air_drag",
                "name": "drag_area",
                "element": 0,
                "value": 0.22,
                "stderr": 0.01,
                "unit": "m²",
                "note": "",
            }
        ],
        "history": [entry(2)],
        **changes,
    }


def model_document(version: int = 2, **changes: Any) -> dict[str, Any]:
    """What a saved model's file holds, as far as the service looks into it."""
    return {
        "format": "joulepath-model/1",
        **MODEL,
        "version": version,
        "vehicle": {"name": "minibalance"},
        "custom": [],
        "surfaces": [],
        "stderr": None,
        "history": [entry(v) for v in range(2, version + 1)],
        **changes,
    }
