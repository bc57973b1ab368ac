"""A cart pushed by the wind: a wheel sensor gives its speed at each step, a camera its position at every fourth."""

import control

from replication.estimation import multirate

cart = control.ss([[1.0, 0.1], [0.0, 0.98]], [[0.0], [0.1]], [[0.0, 1.0], [1.0, 0.0]], 0, 0.1)
best = multirate.design(cart, periods=(1, 4), noise=[0.5, 0.1]).named(states=["position", "speed"])
print(f"guaranteed level: {best.value:.6f}")
print(f"level of a Kalman filter for the same noise: {best.fact('level of the Kalman filter').value:.6f}")
observer = best.observer()  # runs in a loop
print("estimate:", observer.step(None, [0.2, None]).round(3))  # None: no camera picture at this step
figure = multirate.simulate(best, 60, disturbance="worst").plot()  # what hurts most
