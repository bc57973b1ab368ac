"""Two mixers joined by a pipe through which the liquid takes 0.6 s; the first is measured, the second estimated."""

from replication.estimation import delay

mixers = delay.delay_system(
    [[-1.5, 0.3], [0.8, -0.9]], [[[0.4, 0], [0, 0]]], [0.6], b=[[1, 0], [0, 1]], c10=[[0, 1]], c2=[[1, 0]]
)
print(delay.analyse(mixers))
best = delay.design(mixers, margin=0.02)
print(best)
observer = best.observer(dt=0.02)
for first in (0.0, 0.1, 0.2, None, 0.3):  # None: the measurement was lost
    print(observer.step(None, first))
figure = best.plot()
