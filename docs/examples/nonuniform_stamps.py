"""A load that swings at 0.8 Hz, seen by a camera every 10 to 100 ms; each picture has a time stamp."""

from replication.estimation import nonuniform

load = nonuniform.SampledPlant(A=[[0, 1], [-25.3, -0.6]], B=[[0, 0], [25.3, 0]], C=[[1, 0]], D=[[0, 0.1]], L=[[1, 0]])
stamped = nonuniform.design_stamped(load, periods=(0.01, 0.1), horizon=100)
without = nonuniform.design(load, periods=(0.01, 0.1), leaves=4, horizon=100)
print(stamped)
print("without time stamps:", without.bracket)
observer = stamped.observer()  # runs in a loop
print("estimates:", observer.step([0.4], t=0.0), observer.step([0.37], t=0.03), observer.predict(0.05))
figure = stamped.plot()
