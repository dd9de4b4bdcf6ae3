"""Calibration by sockets as published: positions of the ball in a socket shall agree, and two sockets be as far apart as they are.

G. Franzese, M. Spahn, J. Kober, C. Della Santina (2025), arXiv:2503.12584: six errors for every joint and three of the ball, exact
derivatives by CasADi, at most 30 iterations of Ipopt, 1e-4 on the squared errors of the joints for every place; no masses, no choice of
terms. Each place of the fixture is left out in turn.
"""

import json
import sys
import time

import casadi as ca
import numpy as np

request = json.load(sys.stdin)
origins, ball = np.array(request["origins"]), np.array(request["ball"])
q, place, socket = (np.array(request[key]) for key in ("q", "place", "socket"))
count = len(origins)


def turned(rpy):
    """Rotation matrix of roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = ([f(rpy[k]) for k in range(3)] for f in (ca.cos, ca.sin))
    return ca.vertcat(
        ca.horzcat(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        ca.horzcat(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        ca.horzcat(-sp, cp * sr, cp * cr),
    )


errors, angles = ca.SX.sym("errors", 6 * count + 3), ca.SX.sym("q", count)
at, axes = ca.SX.zeros(3), ca.SX.eye(3)
for k in range(count):
    own = errors[6 * k : 6 * k + 6]
    at = at + axes @ (origins[k, :3] + own[:3])
    c, s = ca.cos(angles[k]), ca.sin(angles[k])
    about = ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))
    axes = axes @ turned(origins[k, 3:] + own[3:]) @ about
position = ca.Function("ball", [errors, angles], [at + axes @ (ball + errors[-3:])])


def calibrated(rows):
    """Errors fitted to some rows: variances about the means in the sockets, errors of distances, and small errors of the joints."""
    x = ca.MX.sym("x", errors.numel())
    total = 0
    for name in dict.fromkeys(place[rows]):
        squares, centres, poses = 0, [], 0
        for own in (np.flatnonzero(rows & (place == name) & (socket == s)) for s in ("0", "1")):
            points = position.map(len(own))(x, q[own].T)
            centres.append(ca.sum2(points) / len(own))
            squares += ca.sumsqr(points - ca.repmat(centres[-1], 1, len(own)))
            poses += len(own)
        total += squares / poses + (ca.norm_2(centres[0] - centres[1]) - request["distance"]) ** 2
        total += 1e-4 * ca.sumsqr(x[:-3])
    options = {"ipopt": {"print_level": 0, "max_iter": 30, "sb": "yes"}, "print_time": False}
    solver = ca.nlpsol("calibration", "ipopt", {"x": x, "f": total}, options)
    return np.array(solver(x0=np.zeros(errors.numel()))["x"]).ravel()


def held_out(rows, found):
    """Mean distance, mm, of the ball from its sockets, and the error of their distance, mm."""
    points = np.array(position.map(int(rows.sum()))(found, q[rows].T)).T
    centres = [points[socket[rows] == name].mean(axis=0) for name in ("0", "1")]
    off = [
        np.linalg.norm(points[socket[rows] == n] - c, axis=1)
        for n, c in zip(("0", "1"), centres, strict=True)
    ]
    gap = abs(np.linalg.norm(centres[0] - centres[1]) - request["distance"])
    return 1e3 * np.concatenate(off).mean(), 1e3 * gap


started = time.perf_counter()
calibrated(np.ones(len(q), bool))
seconds = time.perf_counter() - started
scores = [held_out(place == name, calibrated(place != name)) for name in dict.fromkeys(place)]
mean, distance = np.mean(scores, axis=0)
print(json.dumps({"seconds": seconds, "mean_mm": mean, "distance_mm": distance}))
