"""The search for routes: what is asked, what metres and turns cost, paths, motions, results.

    plan, front, graph, matrix,
    reach                            the five questions, each with the function that answers it
    requests, route_graph,
    conditions                       what is asked, and what it means for the power model
    steady, turns, field             costs: of a metre on a slope, of turning, over a map
    situation, grid, se2             map, robot and model together; the cheapest path on them
    trajectory, waypoints            the motion along a path, and a path that costs less
    results, certificate             a route with its account, and the bound of its energy
    solve, goals, tradeoff, legs     what the five questions make of all that

Nothing is imported here, so that checking a request loads no numba.
"""
