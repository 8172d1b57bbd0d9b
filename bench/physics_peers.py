"""Cars of wheels, springs and contacts in MuJoCo and PyBullet, at full speed.

    python physics_peers.py CARS SUBSTEPS

Prints one JSON line: microseconds of each per car and substep of 10 ms. Their cars are multi-body:
a chassis, four wheels on hinges and springs, contacts with a plane; steered and driven. Ours cast
rays with a tyre model; the comparison is of what a simulator of traffic pays for a car, not of
equal mechanics. `null` stands for a package that is not installed.
"""

import json
import sys
import time

STEP_S = 0.01
ROUNDS = 5

WHEEL = """
<body pos="{x} {y} -0.25">
  <joint type="slide" axis="0 0 1" stiffness="30000" damping="3000" springref="0.0"/>
  {steer}
  <joint name="{name}_spin" type="hinge" axis="0 1 0" damping="0.1" armature="0.5"/>
  <geom type="ellipsoid" size="0.34 0.1 0.34" mass="20" friction="1.0 0.005 0.0001"/>
</body>
"""


def mujoco_micros(cars, substeps):
    try:
        import mujoco
    except ImportError:
        return None
    bodies, motors = [], []
    for car in range(cars):
        wheels = []
        for index, (x, y) in enumerate(((1.4, 0.8), (1.4, -0.8), (-1.4, 0.8), (-1.4, -0.8))):
            name = f"c{car}w{index}"
            steer = ""
            if x > 0:
                steer = f'<joint name="{name}_steer" type="hinge" axis="0 0 1" damping="50"/>'
                motors.append(f'<position joint="{name}_steer" kp="5000" ctrlrange="-1 1"/>')
            else:
                motors.append(f'<motor joint="{name}_spin" ctrlrange="-500 500"/>')
            wheels.append(WHEEL.format(x=x, y=y, name=name, steer=steer))
        place = f"{(car % 10) * 60} {(car // 10) * 60} 0.7"
        bodies.append(f'<body pos="{place}"><freejoint/><geom type="box" size="2.2 0.9 0.3" '
                      f'pos="0 0 0.3" mass="1500"/>{"".join(wheels)}</body>')
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="{STEP_S}" integrator="implicitfast"/>
<worldbody><geom type="plane" size="2000 2000 1"/>{"".join(bodies)}</worldbody>
<actuator>{"".join(motors)}</actuator></mujoco>""")
    data = mujoco.MjData(model)
    # Steered a little, driven gently.
    for index in range(model.nu):
        steers = "position" in motors[index]
        data.ctrl[index] = 0.1 if steers else 100.0
    mujoco.mj_step(model, data, nstep=200)
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        mujoco.mj_step(model, data, nstep=substeps)
        times.append(time.perf_counter() - begin)
    assert abs(data.qvel).max() < 1e3, "its cars flew apart"
    return sorted(times)[ROUNDS // 2] / substeps / cars * 1e6


def pybullet_micros(cars, substeps):
    try:
        import pybullet as bullet
        import pybullet_data
    except ImportError:
        return None
    bullet.connect(bullet.DIRECT)
    bullet.setAdditionalSearchPath(pybullet_data.getDataPath())
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(STEP_S)
    bullet.loadURDF("plane.urdf")
    for car in range(cars):
        body = bullet.loadURDF("racecar/racecar.urdf", [(car % 10) * 4, (car // 10) * 4, 0.1])
        for wheel in (2, 3, 5, 7):
            bullet.setJointMotorControl2(
                body, wheel, bullet.VELOCITY_CONTROL, targetVelocity=10, force=10)
        for hinge in (4, 6):
            bullet.setJointMotorControl2(
                body, hinge, bullet.POSITION_CONTROL, targetPosition=0.1)
    for _ in range(100):
        bullet.stepSimulation()
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        for _ in range(substeps):
            bullet.stepSimulation()
        times.append(time.perf_counter() - begin)
    return sorted(times)[ROUNDS // 2] / substeps / cars * 1e6


def main():
    cars, substeps = int(sys.argv[1]), int(sys.argv[2])
    told = {"mujoco": mujoco_micros(cars, substeps), "pybullet": pybullet_micros(cars, substeps)}
    print(json.dumps(told))


if __name__ == "__main__":
    main()
