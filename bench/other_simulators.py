"""The double pendulum of bench/simulation.py in other programs: {what: a call that gives the angles at the end}, for those that are installed."""

from functools import partial

import numpy as np

MJCF = """<mujoco><option gravity="0 0 -9.81" timestep="{step}" integrator="RK4"><flag contact="disable"/></option><worldbody>
<body><joint axis="0 -1 0"/><inertial pos="0 0 -0.5" mass="1" diaginertia="{i} {i} {z}"/>
<body pos="0 0 -1"><joint axis="0 -1 0"/><inertial pos="0 0 -0.5" mass="1" diaginertia="{i} {i} {z}"/></body></body></worldbody></mujoco>"""
MOMENTS = np.array([1.0, 1.0, 1e-3]) / 12


def with_mujoco(start, end):
    import mujoco

    def run(model, data, steps):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = start
        mujoco.mj_step(model, data, nstep=steps)
        return data.qpos.copy()

    for step in (1e-2, 1e-3):
        model = mujoco.MjModel.from_xml_string(MJCF.format(step=step, i=MOMENTS[0], z=MOMENTS[2]))
        yield f"MuJoCo RK4 {step:g}", partial(run, model, mujoco.MjData(model), round(end / step))


def with_exudyn(start, end):
    """Its calls include the assembly of the mechanism, which takes less than a millisecond."""
    import exudyn
    from exudyn.rigidBodyUtilities import HTtranslate
    from exudyn.robotics import Robot, RobotLink

    def run(solver, tolerance=None, step=5e-3):
        system = exudyn.SystemContainer().AddSystem()
        robot = Robot(gravity=[0, 0, -9.81])
        for k in range(2):
            robot.AddLink(RobotLink(mass=1.0, COM=[0, 0, -0.5], inertia=np.diag(MOMENTS), parent=k - 1, preHT=HTtranslate([0, 0, -1.0 * k]), jointType="Ry"))
        system.SetNodeParameter(robot.CreateKinematicTree(system)["nodeGeneric"], "initialCoordinates", [-x for x in start])
        system.Assemble()
        settings = exudyn.SimulationSettings()
        settings.solution.file.write = settings.show.computationTime = False
        how = settings.timeIntegration
        how.endTime, how.numberOfSteps, how.automaticStepSize = end, round(end / step), tolerance is not None
        how.relativeTolerance = how.absoluteTolerance = tolerance or 1e-9
        system.SolveDynamic(settings, solverType=solver)
        return -np.array(system.systemData.GetODE2Coordinates())

    yield "Exudyn RK44 0.001", partial(run, exudyn.DynamicSolverType.RK44, step=1e-3)
    for tolerance in (1e-9, 1e-12):
        yield f"Exudyn DOPRI5 {tolerance:g}", partial(run, exudyn.DynamicSolverType.DOPRI5, tolerance)


def with_drake(start, end):
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, RotationalInertia, SpatialInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

    plant = MultibodyPlant(0.0)
    parent = plant.world_body()
    for k in range(2):
        inertia = SpatialInertia.MakeFromCentralInertia(mass=1.0, p_PScm_E=[0, 0, -0.5], I_SScm_E=RotationalInertia(*MOMENTS))
        body = plant.AddRigidBody(f"rod{k}", inertia)
        hinge = plant.AddFrame(FixedOffsetFrame(f"hinge{k}", parent.body_frame(), RigidTransform([0, 0, -1.0 * k])))
        plant.AddJoint(RevoluteJoint(f"j{k}", hinge, body.body_frame(), [0, -1, 0]))
        parent = body
    plant.Finalize()

    def run(accuracy):
        simulator = Simulator(plant)
        ApplySimulatorConfig(SimulatorConfig(integration_scheme="runge_kutta3", accuracy=accuracy, max_step_size=0.1, use_error_control=True), simulator)
        plant.SetPositions(simulator.get_mutable_context(), start)
        simulator.AdvanceTo(end)
        return plant.GetPositions(simulator.get_context())

    for accuracy in (1e-6, 1e-9):
        yield f"Drake RK3 {accuracy:g}", partial(run, accuracy)


def rows(start, end):
    for make in (with_mujoco, with_exudyn, with_drake):
        try:
            yield from make(start, end)
        except ImportError as e:
            yield f"{make.__name__.removeprefix('with_')}: {e.name} is not installed", None
