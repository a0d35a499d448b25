"""The mechanisms of bench/simulation.py in other programs: what it is, and a call that gives the numbers at the end, for those that are installed."""

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
        solve_in_exudyn(system, end, step, solver, tolerance)
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


class NoResult(Exception):
    """What a program says instead of a result."""


def mjcf_of(m, step, integrator):
    """A model whose joints turn and slide, and are placed without rotation, as MJCF: loops of revolute joints in a plane are points that coincide, as stiff as the step
    allows, and force elements spatial tendons."""
    words = lambda x: " ".join(repr(float(y)) for y in x)
    sites = {link.name: "" for link in m.links}
    for loop in m.loops:
        for side, pose in ((loop.predecessor, loop.predecessor_pose), (loop.successor, loop.successor_pose)):
            sites[side] += f'<site name="{loop.name}_{side}" pos="{words(pose[3:12:4])}"/>'
    for e in m.force_elements:
        for link, point in ((e.link1, e.point1), (e.link2, e.point2)):
            sites[link] += f'<site name="{e.name}_{link}" pos="{words(point)}"/>'

    def body(joint):
        link = m.link(joint.child)
        c, about = about_centre(link)
        about = about + 1e-13 * np.eye(3)
        numbers = (about[0, 0], about[1, 1], about[2, 2], about[0, 1], about[0, 2], about[1, 2])
        inertial = f'<inertial pos="{words(c)}" mass="{link.mass!r}" fullinertia="{words(numbers)}"/>'
        kind = "slide" if joint.kind == "prismatic" else "hinge"
        at = m.relative_pose(m.neutral(), joint.child, joint.parent)[:3, 3]
        own = (
            f'<body name="{joint.child}" pos="{words(at)}"><joint name="{joint.name}" type="{kind}" axis="{words(joint.axis)}"/>{inertial}{sites[joint.child]}'
        )
        return own + "".join(body(j) for j in m.joints if j.parent == joint.child) + "</body>"

    (root,) = (j.child for j in m.joints if j.parent is None)
    bodies = sites[root] + "".join(body(j) for j in m.joints if j.parent == root)
    soft = f'solref="{2 * step!r} 1" solimp="0.9999 0.9999 0.001"'
    equality = "".join(f'<connect site1="{x.name}_{x.predecessor}" site2="{x.name}_{x.successor}" {soft}/>' for x in m.loops)
    tendons = "".join(
        f'<spatial stiffness="{e.stiffness!r}" damping="{e.damping!r}" springlength="{e.free_length!r}"><site site="{e.name}_{e.link1}"/>'
        f'<site site="{e.name}_{e.link2}"/></spatial>'
        for e in m.force_elements
    )
    how = f'timestep="{step!r}" integrator="{integrator}" gravity="{words(m.gravity)}" tolerance="1e-15" iterations="100"'
    return (
        f'<mujoco><compiler balanceinertia="true"/><option {how}><flag contact="disable"/></option><worldbody>{bodies}</worldbody>'
        f"<equality>{equality}</equality><tendon>{tendons}</tendon></mujoco>"
    )


def mechanism_in_mujoco(m, start, v, tau, end, steps):
    import mujoco

    def run(model, data, step):
        mujoco.mj_resetData(model, data)
        for joint, q, rate, effort in zip(m.joint_names, start, v, tau, strict=True):
            of = data.joint(joint)
            of.qpos[0], of.qvel[0], of.qfrc_applied[0] = q, rate, effort
        mujoco.mj_step(model, data, nstep=round(end / step))
        found = np.array([data.joint(joint).qpos[0] for joint in m.joint_names])
        if not abs(data.time - end) < step:  # it begins again where numbers are not finite
            raise NoResult("unstable")
        return found

    for integrator in ("RK4", "implicitfast"):
        for step in steps:
            model = mujoco.MjModel.from_xml_string(mjcf_of(m, step, integrator))
            yield f"MuJoCo {integrator} {step:g}", partial(run, model, mujoco.MjData(model), step)


def about_centre(link):
    """Its centre of mass and the inertia about it."""
    c, (xx, yy, zz, xy, yz, zx) = np.array(link.first_moment) / link.mass, link.inertia
    return c, np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) - link.mass * (c @ c * np.eye(3) - np.outer(c, c))


def tree_in_exudyn(m, start, v, end, steps):
    """As its kinematic tree: joints about axes of their frames."""
    import exudyn
    from exudyn.itemInterface import MarkerKinematicTreeRigid, ObjectConnectorSpringDamper
    from exudyn.rigidBodyUtilities import HTtranslate
    from exudyn.robotics import Robot, RobotLink

    moving = [j for j in m.joints if j.nv]
    number = {j.child: k for k, j in enumerate(moving)}
    sign = np.array([sum(j.axis) for j in moving])

    def run(solver, step, tolerance=None):
        robot = Robot(gravity=list(m.gravity))
        for j in moving:
            (c, inertia), at = about_centre(m.link(j.child)), m.relative_pose(m.neutral(), j.child, j.parent)[:3, 3]
            kind = ("P" if j.kind == "prismatic" else "R") + "xyz"[int(np.argmax(np.abs(j.axis)))]
            own = {"mass": m.link(j.child).mass, "COM": list(c), "inertia": inertia}
            robot.AddLink(RobotLink(**own, parent=number.get(j.parent, -1), preHT=HTtranslate(list(at)), jointType=kind))
        system = exudyn.SystemContainer().AddSystem()
        made = robot.CreateKinematicTree(system)
        for name, values in (("initialCoordinates", start), ("initialCoordinates_t", v)):
            system.SetNodeParameter(made["nodeGeneric"], name, list(sign * [values[j.v_index] for j in moving]))
        of = {"objectNumber": made["objectKinematicTree"]}
        for e in m.force_elements:
            sides = ((e.link1, e.point1), (e.link2, e.point2))
            ends = [system.AddMarker(MarkerKinematicTreeRigid(**of, linkNumber=number[link], localPosition=list(p))) for link, p in sides]
            system.AddObject(ObjectConnectorSpringDamper(markerNumbers=ends, referenceLength=e.free_length, stiffness=e.stiffness, damping=e.damping))
        solve_in_exudyn(system, end, step, solver, tolerance)
        found = dict(zip((j.name for j in moving), sign * np.array(system.systemData.GetODE2Coordinates()), strict=True))
        return np.array([found[name] for name in m.joint_names])

    for step in (10 * steps[0], steps[0]):
        yield f"Exudyn generalised alpha {step:g}", partial(run, exudyn.DynamicSolverType.GeneralizedAlpha, step)
    yield "Exudyn DOPRI5 1e-06", partial(run, exudyn.DynamicSolverType.DOPRI5, steps[0], 1e-6)


def solve_in_exudyn(system, end, step, solver, tolerance=None):
    import exudyn

    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = settings.show.computationTime = False
    how = settings.timeIntegration
    how.endTime, how.numberOfSteps, how.automaticStepSize = end, round(end / step), tolerance is not None
    how.relativeTolerance = how.absoluteTolerance = tolerance or 1e-9
    how.newton.useModifiedNewton = True
    how.newton.relativeTolerance, how.newton.absoluteTolerance = 1e-8, 1e-10
    system.SolveDynamic(settings, solverType=solver)


def mechanism_in_drake(m, start, v, tau, end, steps):
    """Trees whose joints turn and slide; mechanisms with loops are left out."""
    if m.loops:
        return
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, LinearSpringDamper, PrismaticJoint, RevoluteJoint, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

    plant = MultibodyPlant(0.0)
    (root,) = (j.child for j in m.joints if j.parent is None)
    bodies = {root: plant.world_body()}
    for j in m.joints:
        if not j.nv:
            continue
        link = m.link(j.child)
        xx, yy, zz, xy, yz, zx = np.array(link.inertia) / link.mass
        inertia = SpatialInertia(link.mass, np.array(link.first_moment) / link.mass, UnitInertia(xx, yy, zz, xy, zx, yz))
        bodies[j.child] = plant.AddRigidBody(j.child, inertia)
        at = RigidTransform(m.relative_pose(m.neutral(), j.child, j.parent)[:3, 3])
        frame = plant.AddFrame(FixedOffsetFrame(f"of {j.name}", bodies[j.parent].body_frame(), at))
        kind = PrismaticJoint if j.kind == "prismatic" else RevoluteJoint
        plant.AddJoint(kind(j.name, frame, bodies[j.child].body_frame(), j.axis))
    for e in m.force_elements:
        plant.AddForceElement(LinearSpringDamper(bodies[e.link1], e.point1, bodies[e.link2], e.point2, e.free_length, e.stiffness, e.damping))
    plant.mutable_gravity_field().set_gravity_vector(m.gravity)
    plant.Finalize()
    joints = [plant.GetJointByName(name) for name in m.joint_names]

    def run(accuracy):
        simulator = Simulator(plant)
        ApplySimulatorConfig(SimulatorConfig(integration_scheme="radau3", accuracy=accuracy, max_step_size=0.1, use_error_control=True), simulator)
        context, state = simulator.get_mutable_context(), np.empty(2 * len(joints))
        for joint, q, rate in zip(joints, start, v, strict=True):
            state[joint.position_start()], state[len(joints) + joint.velocity_start()] = q, rate
        plant.SetPositionsAndVelocities(context, state)
        simulator.AdvanceTo(end)
        found = plant.GetPositions(simulator.get_context())
        return np.array([found[joint.position_start()] for joint in joints])

    for accuracy in (1e-3, 1e-6):
        yield f"Drake Radau3 {accuracy:g}", partial(run, accuracy)


def mechanism_in_exudyn(m, start, v, tau, end, steps):
    """In a plane, as bodies with three coordinates each and equations for all joints; trees as such; others are left out."""
    if not m.loops:
        yield from tree_in_exudyn(m, start, v, end, steps)
        return
    if any(j.axis != (0.0, 0.0, 1.0) for j in m.joints if j.nv):
        return
    import exudyn
    from exudyn.itemInterface import (
        LoadTorqueVector, MarkerBodyPosition, MarkerBodyRigid, NodeRigidBody2D, ObjectConnectorSpringDamper, ObjectGround, ObjectJointRevolute2D, ObjectRigidBody2D,
    )  # fmt: skip

    moving = [j for j in m.joints if j.nv]

    def run(step):
        system = exudyn.SystemContainer().AddSystem()
        bodies, centres, angles = {}, {}, {}
        (ground,) = (j.child for j in m.joints if j.parent is None)
        bodies[ground], centres[ground], angles[ground] = system.AddObject(ObjectGround()), np.zeros(3), 0.0
        for j in moving:
            link, pose = m.link(j.child), m.frame_pose(start, j.child)
            c = np.array(link.first_moment) / link.mass
            centre, angle = pose[:3, :3] @ c + pose[:3, 3], angles[j.parent] + start[j.q_index]
            node = system.AddNode(NodeRigidBody2D(referenceCoordinates=[centre[0], centre[1], angle]))
            inertia = link.inertia[2] - link.mass * (c[0] ** 2 + c[1] ** 2)
            bodies[j.child] = system.AddObject(ObjectRigidBody2D(physicsMass=link.mass, physicsInertia=inertia, nodeNumber=node))
            centres[j.child], angles[j.child] = c, angle
        point = lambda link, at: system.AddMarker(MarkerBodyPosition(bodyNumber=bodies[link], localPosition=list(np.asarray(at, float) - centres[link])))
        for j in moving:
            at = m.relative_pose(m.neutral(), j.child, j.parent)[:3, 3]
            system.AddObject(ObjectJointRevolute2D(markerNumbers=[point(j.parent, at), point(j.child, (0, 0, 0))]))
        for x in m.loops:
            ends = [point(x.predecessor, x.predecessor_pose[3:12:4]), point(x.successor, x.successor_pose[3:12:4])]
            system.AddObject(ObjectJointRevolute2D(markerNumbers=ends))
        for e in m.force_elements:
            ends = [point(e.link1, e.point1), point(e.link2, e.point2)]
            system.AddObject(ObjectConnectorSpringDamper(markerNumbers=ends, referenceLength=e.free_length, stiffness=e.stiffness, damping=e.damping))
        for j in moving:
            if tau[j.v_index]:
                system.AddLoad(LoadTorqueVector(markerNumber=system.AddMarker(MarkerBodyRigid(bodyNumber=bodies[j.child])), loadVector=[0, 0, tau[j.v_index]]))
        solve_in_exudyn(system, end, step, exudyn.DynamicSolverType.GeneralizedAlpha)
        found = dict(zip((j.child for j in moving), np.array(system.systemData.GetODE2Coordinates()).reshape(-1, 3)[:, 2], strict=True)) | {ground: 0.0}
        of = {j.name: start[j.q_index] + found[j.child] - found[j.parent] for j in moving}  # coordinates count from the references
        return np.array([of[name] for name in m.joint_names])

    for step in (10 * steps[0], steps[0]):
        yield f"Exudyn generalised alpha {step:g}", partial(run, step)


def rows_of(m, start, v, tau, end, steps):
    """A mechanism with force elements, which is built from KSL's model."""
    for make in (mechanism_in_mujoco, mechanism_in_exudyn, mechanism_in_drake):
        try:
            yield from make(m, start, v, tau, end, steps)
        except ImportError as e:
            yield f"{make.__name__.removeprefix('mechanism_in_')}: {e.name} is not installed", None
