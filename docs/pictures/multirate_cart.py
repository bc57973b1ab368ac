"""Wind and noise that are worst for the Kalman filter: true position, camera pictures, both estimates."""

import control
import numpy as np

from replication.drawing.style import FOREGROUND, GREY, OURS, house_style, name_axes, name_end, new_axes
from replication.estimation import multirate

STEPS, NOISE, PERIODS = 60, (0.5, 0.1), (1, 4)
cart = control.ss([[1.0, 0.1], [0.0, 0.98]], [[0.0], [0.1]], [[0.0, 1.0], [1.0, 0.0]], 0, 0.1)
best, kalman = (multirate.design(cart, goal=goal, periods=PERIODS, noise=list(NOISE)) for goal in ("hinf", "h2"))
bad = multirate.simulate(kalman, STEPS, disturbance="worst").signals["disturbance"]
state, truth, pictures, estimates = np.zeros((2, 1)), [], [], []
observers = best.observer(), kalman.observer()
for k, (wind, *noise) in enumerate(bad):
    speed, position = (cart.C @ state).ravel() + np.multiply(NOISE, noise)
    seen = k % PERIODS[1] == 0
    truth.append(state[0, 0])
    pictures += [(0.1 * k, position)] if seen else []
    estimates.append([observer.step(None, [speed, position if seen else None])[0] for observer in observers])
    state = cart.A @ state + cart.B * wind

with house_style():
    figure, (axes, errors) = new_axes(2, row_height=1.7)
    time = 0.1 * np.arange(STEPS)
    axes.plot(time, truth, color=FOREGROUND, linewidth=1.6)
    axes.plot(*zip(*pictures, strict=True), "o", color=GREY, markersize=4)
    for panel, offset in ((axes, 0.0), (errors, np.array(truth))):
        for column, (colour, dashes) in enumerate(((OURS, "-"), (GREY, "--"))):
            panel.plot(time, np.array(estimates)[:, column] - offset, dashes, color=colour, linewidth=1.4)
    name_axes(axes, "position (m): truth, camera (dots), estimates", ticks=3)
    name_axes(errors, "error of the estimate (m)", "time (s)", ticks=3)
    name_end(errors, errors.lines[0], "this design", lift=6)
    name_end(errors, errors.lines[1], "Kalman", lift=-6)
