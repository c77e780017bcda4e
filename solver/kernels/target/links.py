"""Links between shells that share no node: ties, which are kinematic, and rivets, which are springs that break.

Both hang on anchors: a point that moves with the mean of some nodes and turns with the mean of their turns,
    v = sum w v_i + (sum w omega_i) x arm;
a force there is shared out in the same weights, with its moment about the mean. Forces and moments are therefore kept
exactly, and their power is that of the nodes.

anchors: start (k + 1,) where the nodes of each begin, member (n,), weight (n,).
"""

from __future__ import annotations

from numba import njit

NO_LIMIT, ONE_WAY, EITHER_WAY = 0.0, 1.0, 2.0
"""Last constant of a rivet: never breaks; its tension counts; a pull along it counts either way."""


@njit(cache=True, inline="always")
def crossed(a, b, out):
    """a x b into out (3,)."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def mean_of(first, last, member, weight, values, out):
    """Weighted mean of the rows (m, 3) of an anchor's nodes, into out (3,)."""
    out[:] = 0.0
    for i in range(first, last):
        for c in range(3):
            out[c] += weight[i] * values[member[i], c]


@njit(cache=True)
def turn(vector, spin, dt):
    """Turn a vector (3,) in place by the rate `spin` [rad/s] over dt [s], its length kept (Cayley's rotation)."""
    h = 0.5 * dt
    squared = 0.0
    along = 0.0
    for c in range(3):
        squared += (h * spin[c]) ** 2
        along += h * spin[c] * vector[c]
    x = h * (spin[1] * vector[2] - spin[2] * vector[1])
    y = h * (spin[2] * vector[0] - spin[0] * vector[2])
    z = h * (spin[0] * vector[1] - spin[1] * vector[0])
    gain = 1.0 / (1.0 + squared)
    old = (vector[0], vector[1], vector[2])
    cross = (x, y, z)
    for c in range(3):
        vector[c] = gain * ((1.0 - squared) * old[c] + 2.0 * cross[c] + 2.0 * along * h * spin[c])


@njit(cache=True)
def push_at(first, last, member, weight, lever, force, moment, sign, nodal):
    """Share a force (3,) at `lever` (3,) from an anchor's mean, and a moment (3,), among its nodes (m, 6)."""
    for i in range(first, last):
        w = sign * weight[i]
        p = member[i]
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            nodal[p, c] += w * force[c]
            nodal[p, 3 + c] += w * (moment[c] + lever[d] * force[e] - lever[e] * force[d])


@njit(cache=True)
def share_follower_forces(followers, start, member, weight, arm, nodal, applied):
    """Forces of tied nodes pass to those that they follow; nodal (m, 6), applied (m, 3): theirs are then zero."""
    for k in range(followers.shape[0]):
        p = followers[k]
        for c in range(3):
            nodal[p, c] += applied[p, c]
            applied[p, c] = 0.0
        push_at(start[k], start[k + 1], member, weight, arm[k], nodal[p, :3], nodal[p, 3:], 1.0, nodal)
        nodal[p, :] = 0.0


@njit(cache=True)
def follow_nodes(followers, start, member, weight, drift, arm, v, omega, x):
    """Tied nodes take the motion of those that they follow over `drift` [s], and their new places.

    At drift = 0 velocities alone are set.
    """
    rotated = arm[0].copy() if followers.shape[0] else v[0].copy()
    for k in range(followers.shape[0]):
        p = followers[k]
        mean_of(start[k], start[k + 1], member, weight, v, v[p])
        mean_of(start[k], start[k + 1], member, weight, omega, omega[p])
        if drift == 0.0:
            crossed(omega[p], arm[k], rotated)
            for c in range(3):
                v[p, c] += rotated[c]
            continue
        rotated[:] = arm[k]
        turn(rotated, omega[p], drift)
        for c in range(3):
            v[p, c] += (rotated[c] - arm[k, c]) / drift
            arm[k, c] = rotated[c]
            x[p, c] += drift * v[p, c]


@njit(cache=True)
def rivet_forces(anchors, constants, dt, x, v, omega, state, nodal, room):
    """Forces of rivets after a step of dt [s], added to nodal (m, 6) [N, N m]; returns the energy taken [J].

    anchors: start (2 k + 1,), member and weight, of both ends of each, one after the other; constants (k, 8): stiffness
    along [N/m], across [N/m] and rotational [N m/rad], strengths N and S [N], exponents a and b, and NO_LIMIT, ONE_WAY
    or EITHER_WAY. state, in and out: arm (2 k, 3) [m]; lever (2 k, 3) [m] from the ends' means to where the force
    acts, which is one point for both; axes (k, 3, 3), the first along the rivet; give (k, 6) [m, rad] in these axes;
    force (k, 6) [N, N m], of the second end in global axes; broken (k,): 0, 1 in the step that reaches its strength,
    2 afterwards; held (k,) [s], for how long it has carried; taken (k,) [J]. room (8, 3).

    N is tension along the rivet, S the shear: it breaks at (N/Nu)^a + (S/Su)^b = 1, where its force is cut to that
    surface; from the next step on it carries nothing.
    """
    start, member, weight = anchors
    arm, lever, axes, give, force, broken, held, taken = state
    total = 0.0
    for k in range(constants.shape[0]):
        if broken[k] == 2:
            continue
        held[k] += dt
        new, rates, spins, moment = room[0], room[1:3], room[3:5], room[5]
        work = 0.0
        for a in range(2 * k, 2 * k + 2):
            mean_of(start[a], start[a + 1], member, weight, v, rates[a - 2 * k])
            mean_of(start[a], start[a + 1], member, weight, omega, spins[a - 2 * k])
        opening_rate(rates, spins, lever[2 * k], lever[2 * k + 1], moment)
        for c in range(3):
            work -= 0.5 * dt * (force[k, c] * moment[c] + force[k, 3 + c] * (spins[1, c] - spins[0, c]))
            new[c] = 0.5 * dt * moment[c]
        if broken[k] == 1:
            broken[k] = 2
            force[k, :] = 0.0
            taken[k] += work
            total += work
            continue
        meet(2 * k, start, member, weight, dt, x, spins, arm, lever, room)
        opening_rate(rates, spins, lever[2 * k], lever[2 * k + 1], moment)
        for c in range(3):
            new[c] += 0.5 * dt * moment[c]
            room[6, c] = spins[1, c] - spins[0, c]
            room[7, c] = 0.5 * (spins[0, c] + spins[1, c])
        stretch(dt, new, room, axes[k], give[k])
        gain = 1.0
        if constants[k, 7] != NO_LIMIT and use_of_strength(constants[k], give[k], 1.0) >= 1.0:
            gain = surface(constants[k], give[k])
            broken[k] = 1
        spring_force(constants[k], gain, give[k], axes[k], force[k])
        for c in range(3):
            work -= 0.5 * dt * (force[k, c] * moment[c] + force[k, 3 + c] * room[6, c])
        for a in range(2 * k, 2 * k + 2):
            sign = 2.0 * (a - 2 * k) - 1.0
            push_at(start[a], start[a + 1], member, weight, lever[a], force[k, :3], force[k, 3:], sign, nodal)
        taken[k] += work
        total += work
    return total


@njit(cache=True)
def opening_rate(rates, spins, first, second, out):
    """Velocity of the second end against the first at the point where the force acts, into out (3,).

    rates, spins (2, 3): of the ends' means; first, second (3,): levers from these to the point.
    """
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        out[c] = rates[1, c] - rates[0, c]
        out[c] += spins[1, d] * second[e] - spins[1, e] * second[d]
        out[c] -= spins[0, d] * first[e] - spins[0, e] * first[d]


@njit(cache=True)
def stretch(dt, new, room, axes, give):
    """Turn a rivet's axes (3, 3) and add to what it gives (6,): opening `new` (3,) [m], relative spin in room[6]."""
    for axis in range(3):
        turn(axes[axis], room[7], dt)
        for c in range(3):
            give[axis] += axes[axis, c] * new[c]
            give[3 + axis] += dt * axes[axis, c] * room[6, c]


@njit(cache=True)
def spring_force(row, gain, give, axes, force):
    """Force and moment (6,) on the second end, `gain` times those of the springs."""
    for c in range(3):
        force[c] = force[3 + c] = 0.0
        for axis in range(3):
            stiffness = row[0] if axis == 0 else row[1]
            force[c] -= gain * stiffness * give[axis] * axes[axis, c]
            force[3 + c] -= gain * row[2] * give[3 + axis] * axes[axis, c]


@njit(cache=True)
def meet(first, start, member, weight, dt, x, spins, arm, lever, room):
    """Levers from both ends' means to the point midway between the ends, after the arms have turned."""
    middle, means = room[5], room[6:8]
    middle[:] = 0.0
    for end in range(2):
        a = first + end
        turn(arm[a], spins[end], dt)
        mean_of(start[a], start[a + 1], member, weight, x, means[end])
        for c in range(3):
            middle[c] += 0.5 * (means[end, c] + arm[a, c])
    for end in range(2):
        for c in range(3):
            lever[first + end, c] = middle[c] - means[end, c]


@njit(cache=True)
def use_of_strength(row, give, gain):
    """(N/Nu)^a + (S/Su)^b of a rivet at `gain` times its elastic force; N of sheets in one plane either way."""
    opened = abs(give[0]) if row[7] == EITHER_WAY else max(give[0], 0.0)
    tension = gain * row[0] * opened
    shear = gain * row[1] * (give[1] ** 2 + give[2] ** 2) ** 0.5
    return (tension / row[3]) ** row[5] + (shear / row[4]) ** row[6]


@njit(cache=True)
def surface(row, give):
    """The share of its elastic force at which a rivet beyond its strength is just at it."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if use_of_strength(row, give, middle) >= 1.0:
            high = middle
        else:
            low = middle
    return high
