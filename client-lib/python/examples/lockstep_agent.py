"""Two clients in lockstep: one advances the world, the other drives, and each tick waits for it.

    python client-lib/python/examples/lockstep_agent.py
"""

import sys
import threading

import numpy as np

import omnibus

TICKS = 40


def main(map: str | None = None) -> None:
    with omnibus.launch(map, ego="vehicle.tesla.model3", autopilot=False) as simulator:
        assert simulator.ego is not None
        agent = omnibus.Client("agent", simulator.name)
        agent.join_barrier()
        driving = threading.Thread(target=drive, args=(agent, simulator.ego))
        driving.start()
        for _ in range(TICKS):
            # Returns when the agent has arrived at this frame.
            simulator.client.tick()
        driving.join()
        car = simulator.client.world.actor(simulator.ego)
        speed_mps = float(np.linalg.norm(car["velocity_mps"]))
        print(f"after {TICKS} ticks the car drives {speed_mps:.2f} m/s")


def drive(agent: omnibus.Client, car_id: int) -> None:
    with agent:
        for _ in range(TICKS):
            car = agent.await_frame().actor(car_id)
            speed_mps = float(np.linalg.norm(car["velocity_mps"]))
            throttle = min(max(0.2 * (8.0 - speed_mps), 0.0), 0.8)
            agent.control(car_id, throttle=throttle)
            agent.arrive()
        agent.leave_barrier()


if __name__ == "__main__":
    main(*sys.argv[1:])
