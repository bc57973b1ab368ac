"""Height of a drone: a barometer at every step of 0.1 s, a satellite fix every fifth, two steps later."""

import control

from replication.estimation import multirate

names = {"states": ["height", "climb"], "inputs": ["gust"], "outputs": ["barometer", "satellite"]}
drone = control.ss([[1.0, 0.1], [0.0, 0.95]], [[0.005], [0.1]], [[1.0, 0.0], [1.0, 0.0]], 0, 0.1, **names)
best = multirate.design(drone, periods=(1, 5), offsets=(0, 2), noise=[2.0, 0.3])
print(best)  # level, bracket, evidence
observer = best.observer()
for heights in ([0.4, None], [0.6, None], [0.5, 0.45]):  # None: no satellite fix at this step
    print(observer.step(None, heights))
figure = best.plot()
