"""How fast errors die out: the slower the sensor, the more hangs on what fills the gaps."""

import numpy as np

from replication.drawing.panels import Panel, draw
from replication.estimation import dualrate

PERIOD = 0.01
servo = dualrate.make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
ratios = np.array([1, 2, 5, 10, 20, 50, 100])
names = ("fast_sensor", "running_prediction", "held_measurement", "model_interpolation", "alternating_predictive")
radii = [dualrate.compare(dualrate.design(servo, period=PERIOD, ratio=int(ratio))) for ratio in ratios]
seconds = ratios * PERIOD
rates = {name: -np.log([found[name] for found in radii]) / seconds for name in names}
last = [rates[name][-1] for name in names]
assert last == sorted(last, reverse=True)  # the order that the text names
lines = {name.replace("_", " "): rate for name, rate in rates.items()}
figure = draw([Panel(np.log10(seconds), "between two measurements, log10 of s", "rate of decay (1/s)", lines, {})])
