"""README's first screen: particles in a spherical cavity."""

import swarm

scene = swarm.Scene([swarm.Sphere(radius=0.5)])
gas = swarm.fill(scene, 10_000, speed=0.5, seed=1)
result = swarm.simulate(scene, gas, swarm.Impact(), until=10.0, every=0.1, trajectory="sphere.h5")

print(result.observables["impacts"][-1], "impacts")
print(result.observables["energy_error"].max(), "worst relative energy error of a particle")

with swarm.load("sphere.h5") as trajectory:
    print(trajectory.times[-1], trajectory.frame(-1).velocity[:, 0])
