"""Pictures of an answer: the map with its routes, profiles, and a card for notebooks.

    answer.plot()        matplotlib figure      answer          in a notebook: picture and figures

Colours of power: blue gives energy back, then yellow, orange, red to violet for what costs most.
"""

from __future__ import annotations

import html as escape
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.search.relief_image import Window, as_data_url, relief_image, window_round
from planner.search.wording import called, extra_share, joules, metres, seconds

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from planner.search.route import Answer, Route

Array = NDArray[np.float64]

POWER_COLOURS = ((255, 224, 138), (249, 142, 60), (214, 48, 79), (107, 26, 123))
GIVEN_BACK = (38, 110, 220)
BASELINE_COLOURS = {"shortest": "#10747a", "fastest": "#374151"}
_STEPS = 32


def seen(watts: Array) -> Array:
    """W as far as three digits of the largest show them.

    Power is a sum of effects: what is less is the rounding of that sum, and gives nothing back.
    """
    most = float(np.abs(watts).max(initial=0.0))
    shown: Array = watts if most == 0 else np.round(watts, max(0, 2 - math.floor(math.log10(most))))
    return shown


def power_range(watts: Array) -> tuple[float, float]:
    """W at both ends of the colours: zero, or what is nearly the least and the most."""
    if len(watts) < 2:
        return 0.0, 1.0
    low, high = np.quantile(watts[1:], [0.02, 0.98])
    return max(0.0, float(low)), max(float(high), max(0.0, float(low)) + 1e-9)


def power_colour(watts: float, low: float, high: float) -> tuple[int, int, int]:
    """Red, green, blue of a power between ``low`` and ``high`` W."""
    if watts < 0:
        return GIVEN_BACK
    place = min(max((watts - low) / (high - low), 0.0), 1.0) * (len(POWER_COLOURS) - 1)
    k = min(int(place), len(POWER_COLOURS) - 2)
    a, b = POWER_COLOURS[k], POWER_COLOURS[k + 1]
    red, green, blue = (round(p + (q - p) * (place - k)) for p, q in zip(a, b, strict=True))
    return red, green, blue


def routes_of(answer: Answer) -> dict[str, Route]:
    """The route, its alternatives and the baselines, each by what to call it."""
    named = {
        "route" if k == 0 else f"alternative {k}": route for k, route in enumerate(answer.routes)
    }
    return named | {name: baseline.route for name, baseline in answer.baselines.items()}


def window_of(answer: Answer) -> Window:
    """The part of the map that shows all routes of an answer."""
    routes = routes_of(answer).values()
    if not routes:
        return answer.terrain.extent
    xs, ys = (np.concatenate([route.arrays[k] for route in routes]) for k in ("x", "y"))
    return window_round(answer.terrain, xs, ys)


def coloured_pieces(route: Route) -> Iterator[tuple[str, list[int]]]:
    """Runs of poses that share a colour of power, each with its colour; runs meet in a pose."""
    watts = seen(route.arrays["watts"])
    low, high = power_range(watts)

    def step(k: int) -> int:
        return -1 if watts[k] < 0 else round((watts[k] - low) / (high - low) * _STEPS)

    first = 1
    for k in range(2, len(watts) + 1):
        if k == len(watts) or step(k) != step(first):
            middle = float(np.median(watts[first:k]))
            yield (
                "#{:02x}{:02x}{:02x}".format(*power_colour(middle, low, high)),
                [*range(first - 1, k)],
            )
            first = k


def map_svg(answer: Answer, *, width: int = 720, identity: str = "map") -> str:
    """The map with all routes as SVG, the best one coloured by its power.

    Args:
        answer: with or without a route.
        width: in pixels.
        identity: id of the SVG element, unique in a page.
    """
    window = window_of(answer)
    x0, y0, x1, y1 = window
    scale = width / (x1 - x0)
    height = (y1 - y0) * scale

    def points(xs: Array, ys: Array) -> str:
        return " ".join(
            f"{(x - x0) * scale:.1f},{(y1 - y) * scale:.1f}" for x, y in zip(xs, ys, strict=True)
        )

    relief = as_data_url(relief_image(answer.terrain, window, pixels=min(1000, 2 * width)))
    parts = [
        f'<svg id="{identity}" class="map" viewBox="0 0 {width} {height:.1f}" role="img" '
        f'data-x0="{x0}" data-y1="{y1}" data-scale="{scale}" xmlns="http://www.w3.org/2000/svg">',
        f"<title>Relief of {escape.escape(answer.terrain.name)} with the routes</title>",
        f'<image href="{relief}" width="{width}" height="{height:.1f}" '
        'preserveAspectRatio="none"/>',
    ]
    named = routes_of(answer)
    for name, route in reversed(named.items()):
        if name == "route":
            continue
        colour = BASELINE_COLOURS.get(name, "#5b3a8c")
        line = points(route.arrays["x"], route.arrays["y"])
        parts.append(
            f'<polyline points="{line}" fill="none" stroke="#fff" stroke-opacity=".55" '
            'stroke-width="4"/>'
            f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2" '
            f'stroke-dasharray="{"7 5" if name == "shortest" else "2 4"}"/>'
        )
    if "route" in named:
        parts += _route_parts(named["route"], points)
    parts.append(scale_bar(x1 - x0, width, height))
    return "".join(parts) + "</svg>"


def _route_parts(route: Route, points: object) -> list[str]:
    place = points
    assert callable(place)
    xs, ys, yaw = (route.arrays[k] for k in ("x", "y", "yaw"))
    parts = [
        f'<polyline points="{place(xs, ys)}" fill="none" stroke="#fff" stroke-width="7.5" '
        'stroke-linejoin="round" stroke-linecap="round"/>'
    ]
    for colour, run in coloured_pieces(route):
        parts.append(
            f'<polyline points="{place(xs[run], ys[run])}" fill="none" stroke="{colour}" '
            'stroke-width="4.5" stroke-linejoin="round" stroke-linecap="round"/>'
        )
    # Where the front of the robot points: it need not be where it goes.
    along = route.distance_m
    marks = np.searchsorted(along, np.linspace(0, along[-1], 14)[1:-1])
    for k in marks:
        x, y = place(xs[k : k + 1], ys[k : k + 1]).split(",")
        turn = -math.degrees(float(yaw[k]))
        parts.append(
            f'<path d="M7,0L-3.5,-3.6L-1.5,0L-3.5,3.6Z" fill="#111827" stroke="#fff" '
            f'stroke-width=".8" transform="translate({x} {y}) rotate({turn:.1f})"/>'
        )
    for k, colour, what in ((0, "#15803d", "start"), (-1, "#b91c1c", "goal")):
        x, y = place(xs[[k]], ys[[k]]).split(",")
        parts.append(
            f'<g><title>{what}</title><circle cx="{x}" cy="{y}" r="6.5" fill="{colour}" '
            'stroke="#fff" stroke-width="2"/></g>'
        )
    return parts


def scale_bar(metres_wide: float, width: int, height: float) -> str:
    """A bar with its length, for the lower left corner of a map of this many pixels."""
    target = metres_wide / 5
    power = 10 ** math.floor(math.log10(target))
    length = max(m * power for m in (1, 2, 5) if m * power <= target)
    size = length / metres_wide * width
    text = f"{length:g} m" if length < 1000 else f"{length / 1000:g} km"
    y = height - 14
    return (
        f'<g><rect x="10" y="{y - 16:.1f}" width="{size + 16:.1f}" height="24" rx="4" '
        'fill="#fff" fill-opacity=".8"/>'
        f'<path d="M18,{y - 4:.1f}v6h{size:.1f}v-6" fill="none" stroke="#111827" '
        'stroke-width="1.5"/>'
        f'<text x="{18 + size / 2:.1f}" y="{y - 3:.1f}" text-anchor="middle" font-size="11" '
        f'font-family="system-ui,sans-serif" fill="#111827">{text}</text></g>'
    )


def figure(answer: Answer) -> Figure:
    """Map with the route coloured by watts, and its height and power along the way.

    Returns:
        a matplotlib figure that is not known to pyplot, so nothing has to be closed.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    result = Figure(figsize=(11, 5.2), layout="constrained")
    panels = result.subplot_mosaic([["map", "height"], ["map", "power"]], width_ratios=[1.25, 1])
    x0, y0, x1, y1 = window = window_of(answer)
    ground = panels["map"]
    ground.imshow(relief_image(answer.terrain, window, pixels=900), extent=(x0, x1, y0, y1))
    ground.set(xlabel="x (m)", ylabel="y (m)", title=f"{answer.terrain.name}", aspect="equal")
    named = routes_of(answer)
    for name, route in named.items():
        if name != "route":
            colour = BASELINE_COLOURS.get(name, "#5b3a8c")
            ground.plot(route.arrays["x"], route.arrays["y"], "--", linewidth=1.4, color=colour)
            panels["height"].plot(
                route.distance_m, route.arrays["z"], linewidth=1, color=colour, label=name
            )
    if "route" not in named:
        ground.set_title(f"{answer.terrain.name}: no route")
        for name in ("height", "power"):
            panels[name].remove()
        return result
    route = named["route"]
    line = np.column_stack([route.arrays["x"], route.arrays["y"]])
    watts = seen(route.arrays["watts"])
    low, high = power_range(watts)
    scale = LinearSegmentedColormap.from_list("power", np.array(POWER_COLOURS) / 255.0)
    colours = scale.with_extremes(under="#{:02x}{:02x}{:02x}".format(*GIVEN_BACK))
    ground.plot(line[:, 0], line[:, 1], color="white", linewidth=5, solid_capstyle="round")
    pieces = LineCollection(
        list(np.stack([line[:-1], line[1:]], axis=1)), cmap=colours, linewidth=3
    )
    pieces.set_array(watts[1:])
    pieces.set_clim(low, high)
    ground.add_collection(pieces)
    ground.plot(*line[0], "o", color="#15803d", markeredgecolor="white", markersize=9)
    ground.plot(*line[-1], "o", color="#b91c1c", markeredgecolor="white", markersize=9)
    result.colorbar(pieces, ax=ground, label="power (W)", shrink=0.7, location="left")
    panels["height"].plot(route.distance_m, route.arrays["z"], color="#b45309", label="route")
    panels["height"].set(ylabel="height (m)", title=_headline(answer))
    panels["height"].legend(fontsize="small")
    panels["power"].step(
        route.distance_m, route.arrays["watts"], where="pre", color="#b45309", linewidth=1
    )
    panels["power"].axhline(0, color="#9ca3af", linewidth=0.8)
    panels["power"].set(xlabel="distance (m)", ylabel="power (W)")
    return result


def _headline(answer: Answer) -> str:
    route = answer.routes[0]
    return f"{joules(route.energy_j)}, {metres(route.length_m)}, {seconds(route.duration_s)}"


def comparison_rows(answer: Answer) -> list[Mapping[str, str]]:
    """Name, energy, how it compares, length and duration of every route, in words."""
    best = answer.routes[0].energy_j if answer.routes else 0.0
    return [
        {
            "name": name,
            "energy": joules(route.energy_j),
            "more": "" if name == "route" else extra_share(route.energy_j, best),
            "length": metres(route.length_m),
            "duration": seconds(route.duration_s),
        }
        for name, route in routes_of(answer).items()
    ]


def html(answer: Answer) -> str:
    """A card for notebooks: the map and the comparison."""
    if not answer.routes:
        return f"<p><b>No route.</b> {escape.escape(answer.reason or '')}</p>"
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape.escape(cell)}</td>" for cell in cells) + "</tr>"
        for cells in (
            [called(row["name"], answer.planner), *list(row.values())[1:]]
            for row in comparison_rows(answer)
        )
    )
    return (
        f'<div style="max-width:560px">{map_svg(answer, width=560)}'
        "<table><tr><th></th><th>energy</th><th>more</th><th>length</th><th>duration</th></tr>"
        f"{rows}</table></div>"
    )
