"""Height of a drone: a barometer at every step of 0.1 s, a satellite fix every fifth, two steps later."""

import control

from replication.estimation import multirate

A, B, C = [[1.0, 0.1], [0.0, 0.95]], [[0.005], [0.1]], [[1.0, 0.0], [1.0, 0.0]]
drone = control.ss(A, B, C, 0, 0.1, states=["height", "climb"], outputs=["barometer", "satellite"])
best = multirate.design(drone, periods=(1, 5), offsets=(0, 2), noise=[2.0, 0.3])
print(best)
observer = best.observer()  # runs in your loop: None where a sensor is silent
for heights in ([0.4, None], [0.6, None], [0.5, 0.45]):
    estimate = observer.step(None, heights)
print("estimate:", estimate.round(3))
figure = multirate.simulate(best, 60, disturbance="worst").plot()  # what hurts most
