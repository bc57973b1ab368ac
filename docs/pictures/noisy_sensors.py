"""A sensor is worth what its noise leaves of it: in the end the level is that of no sensor at all."""

import control
import numpy as np

from replication.drawing.panels import Panel, draw
from replication.estimation import multirate

oven = control.ss([[0.9]], [[1.0]], [[1.0], [1.0]], 0, 1.0)
noise = np.geomspace(0.1, 100.0, 13)
found = [multirate.design(oven, periods=(2, 3), noise=[size, size]) for size in noise]
levels = np.array([result.value for result in found])
kalman = np.array([result.fact("level of the Kalman filter").value for result in found])
without = found[0].fact("level without sensors").value
assert levels[0] < 0.2 * without and levels[-1] > 0.99 * without  # what the text says of the two ends
lines = {"this observer": levels, "Kalman filter": kalman}
figure = draw([Panel(np.log10(noise), "noise of both sensors, power of ten", "gain", lines, {"no sensors:": without})])
