"""Point after point along a path, compiled: each starts from the one before, so neighbours cost two short passes."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import entry, inner
from camcomp.model.statics.layout import A_CHAIN, A_VAR, SPRINGS
from camcomp.model.statics.point import HOLD, INVERSE, POSE, TARGET, drive_forces, solve_point
from camcomp.model.statics.rigid import OK, OUT_OF_REACH, kinematics
from camcomp.model.statics.vectors import (
    add_to,
    column,
    log_product,
    move,
    part,
    plus,
    set_columns,
    turned,
    turned_back,
)

FAR = 20.0  # mm: a longer way to the next point is walked in steps
LOAD_STEPS = 8


@inner
def put_pose(aim, tip, tool, pose):
    """Fills pose (12,) with orientation aim (9,) with the tip at `tip` (3,)."""
    lever = turned(aim, part(tool, 0))
    for i in range(9):
        pose[i] = aim[i]
    for i in range(3):
        pose[9 + i] = tip[i] - lever[i]


@inner
def approach(rigid, start, start_y, goal, pose, rho, memory, W):
    """Inverse kinematics of goal (12,): from the point before if that is near, else from the start pose in short steps,
    so that the assembly mode stays. Fills rho and W.y. Returns (status, True if from the point before).
    """
    y = W.y
    code = OUT_OF_REACH
    for stage in range(2):
        near = stage == 0
        begin = memory.goal if near else start
        before = memory.y if near else start_y
        turn = log_product(goal, begin)
        way = plus(part(goal, 9), part(begin, 9), -1.0)
        reach = 1.0
        for i in range(3):
            reach = max(reach, max(abs(way[i]) / FAR, abs(turn[i]) / 0.2))
        if (near and (memory.warm[0] == 0 or reach > 1.0)) or not reach < 1e6:
            continue
        steps = math.ceil(reach)
        for i in range(12):
            pose[i] = begin[i]
        for c in range(y.shape[0]):
            for j in range(y.shape[1]):
                y[c, j] = before[c, j]
        for k in range(steps):
            move(pose, way, turn, 1.0 / steps)
            if k == steps - 1:
                for i in range(12):
                    pose[i] = goal[i]
            code = kinematics(rigid, pose, y, rho, W, 0)
        if code == OK:
            return code, near
    return code, False


@inner
def relax(P, joint_var, y, rho, z):
    """Cold start of the elastic machine: joints from the rigid solution y, springs relaxed, no wrench."""
    for c in range(P.chain.shape[0]):
        for i in range(z.shape[1]):
            z[c, i] = 0.0
        for j in range(joint_var.shape[1]):
            if joint_var[c, j] >= 0:
                z[c, joint_var[c, j]] = y[c, j]
    for a in range(rho.shape[0]):
        z[P.actuator[a, A_CHAIN], P.actuator[a, A_VAR]] = rho[a]


@inner
def copy_rows(source, target):
    """Copies a matrix."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@inner
def carry_over(goal, old_goal, old_pose, pose):
    """Pose that stands to goal as old_pose stood to old_goal (all (12,)); translations in machine axes."""
    for i in range(12):
        pose[i] = goal[i]
    add_to(pose, 9, plus(part(old_pose, 9), part(old_goal, 9), -1.0))
    x = turned_back(old_goal, column(old_pose, 0))
    y = turned_back(old_goal, column(old_pose, 1))
    z = turned_back(old_goal, column(old_pose, 2))
    set_columns(pose, turned(goal, x), turned(goal, y), turned(goal, z))


@inner
def solve_one(
    mode, P, rigid, joint_var, tool, start, start_y, follow, check,
    turn, aim, near, tip_aim, force, wrench, rho, rho_nominal, command, pose, memory, W,
):  # fmt: skip
    """One point: from the point before if that was solved, else cold, else with the load in steps. (status, passes)."""
    m = rho.shape[0]
    aimed = mode == TARGET or mode == POSE
    y, z, goal = W.y, memory.z, W.goal
    put_pose(turn, near, tool, goal)
    code, warm = approach(rigid, start, start_y, goal, pose, rho_nominal, memory, W)
    memory.warm[0] = 0
    if code != OK:
        return code, 0
    if mode == INVERSE:
        for i in range(12):
            memory.goal[i] = goal[i]
        copy_rows(y, memory.y)
        memory.warm[0] = 1
        return code, 0
    passes = 0
    f = W.load[0]
    w = W.load[1]
    for attempt in range(0 if warm else 1, 3):
        for i in range(12):
            pose[i] = goal[i]
            command[i] = goal[i]
        copy_rows(y, W.y_command)
        if attempt == 0:  # joints move as those of the rigid machine, everything elastic stays
            for c in range(y.shape[0]):
                for j in range(y.shape[1]):
                    if joint_var[c, j] >= 0:
                        z[c, joint_var[c, j]] += y[c, j] - memory.y[c, j]
                    if aimed:
                        W.y_command[c, j] += memory.y_command[c, j] - memory.y[c, j]
            carry_over(goal, memory.goal, memory.pose, pose)
            if aimed:
                carry_over(goal, memory.goal, memory.command, command)
        if aimed:
            code = kinematics(rigid, command, W.y_command, rho, W, 6)
            if code != OK:
                continue
        elif follow:
            for a in range(m):
                rho[a] = rho_nominal[a]
        if attempt > 0:
            relax(P, joint_var, y, rho, z)
        steps = LOAD_STEPS if attempt == 2 else 1
        for k in range(1, steps + 1):
            for r in range(6):
                w[r] = wrench[r] * (k / steps)
                if r < 3:
                    f[r] = force[r] * (k / steps)
            code, passes = solve_point(
                mode, P, rigid, tool, aim, tip_aim, f, w, rho, pose, z, command, W.y_command, W, check and k == steps
            )
            if code != OK:
                break
        if code == OK:
            break
    if code != OK:
        return code, passes
    for i in range(12):
        memory.pose[i] = pose[i]
        memory.goal[i] = goal[i]
        memory.command[i] = command[i]
    copy_rows(y, memory.y)
    copy_rows(W.y_command, memory.y_command)
    if mode == HOLD:
        for k in range(3):
            force[k] = f[k]
    memory.warm[0] = 1
    return code, passes


@entry
def solve_many(
    mode, P, rigid, joint_var, tool, start, start_y, follow, check,
    turn, aim, near, tip_aim, force, wrench, rho, rho_nominal, commanded, pose, tip, drive, total, status, passes,
    kept, memory, W,
):  # fmt: skip
    """Points one after the other. start (12,): nominal platform pose at the joint coordinates start_y.

    Shapes: turn, aim (n, 9), orientation near the answer and asked for; commanded, pose (n, 12); near, tip_aim, force,
    tip (n, 3); wrench, total (n, 6); rho, rho_nominal, drive (n, m); kept (n or 0, c, nz) keeps the states. follow: the
    commanded tip is `near`. total = sum of the wrenches on the chains.
    """
    for i in range(rho.shape[0]):
        status[i], passes[i] = solve_one(
            mode, P, rigid, joint_var, tool, start, start_y, follow, check,
            turn[i], aim[i], near[i], tip_aim[i], force[i], wrench[i], rho[i], rho_nominal[i], commanded[i], pose[i],
            memory, W,
        )  # fmt: skip
        if status[i] != OK or mode == INVERSE:
            continue
        z = memory.z
        lever = turned(pose[i], part(tool, 0))
        for k in range(3):
            tip[i, k] = pose[i, 9 + k] + lever[k]
        for k in range(6):
            total[i, k] = 0.0
            for c in range(z.shape[0]):
                total[i, k] += z[c, P.chain[c, SPRINGS] + k]
        drive_forces(P, z, W, drive[i])
        if kept.shape[0] > 0:
            for c in range(z.shape[0]):
                for j in range(z.shape[1]):
                    kept[i, c, j] = z[c, j]
