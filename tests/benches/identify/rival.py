"""The problems of `identify-speed` with scipy.optimize.least_squares: `cargo xtask bench identify`.

The residual is one NumPy expression over all rows. The rival knows which parameters can be seen, starts from the
same nominal machine and needs no uncertainties; columns are scaled by what parameters do.
"""

import json
import sys
import time

import numpy as np
from scipy.optimize import least_squares


class Problem:
    def __init__(self, text):
        task = json.loads(text)
        self.task = task
        self.q = np.array([row["q"] for row in task["rows"]])
        self.ball = np.array([row["ball"] for row in task["rows"]])
        self.tip = np.array(task["tip"])
        self.n = len(task["parameters"])
        self.balls = task["balls"]
        rows = len(self.q)
        # What each parameter adds to its component, per unit, in each row.
        self.basis = np.empty((self.n, rows))
        for i, p in enumerate(task["parameters"]):
            q = self.q[:, p["axis"]] if p["axis"] < len(task["axes"]) else np.zeros(rows)
            self.basis[i] = {
                "inter": lambda: np.ones(rows),
                "degree": lambda: q ** p["k"],
                "cosine": lambda: np.cos(p["k"] * q),
                "sine": lambda: np.sin(p["k"] * q),
            }[p["kind"]]()
        # Parameters of the same error of the same axis, added up by one product.
        self.groups = {}
        for i, p in enumerate(task["parameters"]):
            key = (p["axis"], p["kind"] == "inter")
            self.groups.setdefault(key, {}).setdefault(p["component"], []).append(i)
        nominal = self.tips(np.zeros(self.n), self.tip)[0]
        start = [nominal[self.ball == b].mean(axis=0) for b in range(self.balls)]
        self.start = np.concatenate([np.zeros(self.n), self.tip, np.ravel(start)])
        unit = [1e-5 if p["component"] >= 3 else 1e-2 for p in task["parameters"]]
        unit = np.array(unit) / np.abs(self.basis).max(axis=1)
        self.unit = np.concatenate([unit, np.full(3 + 3 * self.balls, 1e-2)])

    def error(self, key, x):
        """x y z a b c of an error in all rows, or none."""
        if key not in self.groups:
            return None
        e = np.zeros((6, len(self.q)))
        for component, which in self.groups[key].items():
            e[component] = x[which] @ self.basis[which]
        return e

    @staticmethod
    def behind(r, t, error):
        """A frame behind Trans(x y z) Rx(a) Ry(b) Rz(c); about what each rotation turns."""
        x, y, z, a, b, c = error
        sa, ca, sb, cb, sc, cc = np.sin(a), np.cos(a), np.sin(b), np.cos(b), np.sin(c), np.cos(c)
        e = np.array(
            [
                [cb * cc, -cb * sc, sb],
                [ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb],
                [sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb],
            ]
        ).transpose(2, 0, 1)
        t = t + np.einsum("nij,nj->ni", r, np.stack([x, y, z], axis=1))
        after = r @ e
        about_y = np.einsum("nij,nj->ni", r, np.stack([np.zeros_like(a), ca, sa], axis=1))
        about = np.stack([r[:, :, 0], about_y, after[:, :, 2]], axis=2)
        return after, t, about

    def moved(self, r, t, axis, component):
        q = self.q[:, axis]
        if component < 3:
            return r, t + r[:, :, component] * q[:, None]
        s, c = np.sin(q), np.cos(q)
        k, l = (component - 2) % 3, (component - 1) % 3
        r = r.copy()
        rk, rl = r[:, :, k].copy(), r[:, :, l].copy()
        r[:, :, k] = rk * c[:, None] + rl * s[:, None]
        r[:, :, l] = rl * c[:, None] - rk * s[:, None]
        return r, t

    def tips(self, x, tip):
        """Tips in the workpiece frame, and the joints of all errors: along, about, through, sign."""
        rows = len(self.q)
        joints = {}
        frames = {}
        for branch, sign in [("Workpiece", -1.0), ("Tool", 1.0)]:
            r, t = np.broadcast_to(np.eye(3), (rows, 3, 3)), np.zeros((rows, 3))
            axes = [(i, a) for i, a in enumerate(self.task["axes"]) if a["branch"] == branch]
            for i, axis in axes:
                for inter in [True, False]:
                    if not inter:
                        r, t = self.moved(r, t, i, axis["component"])
                    error = self.error((i, inter), x)
                    if error is not None:
                        along = r
                        r, t, about = self.behind(r, t, error)
                        joints[(i, inter)] = (along, about, t, sign)
            if branch == "Tool":
                spindle = (len(self.task["axes"]), True)
                error = self.error(spindle, x)
                if error is not None:
                    along = r
                    r, t, about = self.behind(r, t, error)
                    joints[spindle] = (along, about, t, sign)
            frames[branch] = (r, t)
        (rw, tw), (rs, ts) = frames["Workpiece"], frames["Tool"]
        point = rs @ tip + ts
        return np.einsum("nji,nj->ni", rw, point - tw), joints, rw, rs, point

    def residual(self, x):
        tips = self.tips(x[: self.n], x[self.n : self.n + 3])[0]
        return (tips - x[self.n + 3 :].reshape(-1, 3)[self.ball]).ravel()

    def jacobian(self, x):
        _, joints, rw, rs, point = self.tips(x[: self.n], x[self.n : self.n + 3])
        rows = len(self.q)
        j = np.zeros((rows, 3, len(x)))
        for key, components in self.groups.items():
            along, about, through, sign = joints[key]
            for component, which in components.items():
                if component < 3:
                    way = along[:, :, component]
                else:
                    way = np.cross(about[:, :, component - 3], point - through)
                way = sign * np.einsum("nji,nj->ni", rw, way)
                j[:, :, which] = way[:, :, None] * self.basis[which].T[:, None, :]
        j[:, :, self.n : self.n + 3] = np.einsum("nki,nkj->nij", rw, rs)
        for k in range(3):
            j[np.arange(rows), k, self.n + 3 + 3 * self.ball + k] = -1.0
        return j.reshape(3 * rows, -1)

    def solve(self, jac):
        begin = time.process_time()
        found = least_squares(
            self.residual, self.start, jac=jac, x_scale=self.unit, method="trf", xtol=1e-10, ftol=1e-10, gtol=None
        )
        return time.process_time() - begin, found

    def check(self):
        """The derivatives are those of the residual: central differences at drawn places."""
        x = self.start + np.random.default_rng(1).normal(size=len(self.start)) * self.unit
        exact = self.jacobian(x)
        for i in range(0, len(x), max(1, len(x) // 20)):
            step = np.zeros(len(x))
            step[i] = self.unit[i]
            numeric = (self.residual(x + step) - self.residual(x - step)) / (2 * self.unit[i])
            assert np.abs(numeric - exact[:, i]).max() * self.unit[i] < 1e-8, i


def main():
    failed = False
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            problem = Problem(file.read())
        problem.check()
        ours, squares = problem.task["seconds"], problem.task["squares_mm2"]
        print(f"{len(problem.start)} unknowns from {len(problem.q)} probings, one thread, processor time")
        print(f"  trueaxis identify                             {ours:8.3f} s")
        for name, jac in [("analytic Jacobian", problem.jacobian), ("jac='2-point'", "2-point")]:
            seconds, found = problem.solve(jac)
            times = seconds / ours
            same = 2.0 * found.cost / squares - 1.0
            print(
                f"  scipy least_squares, {name:<24} {seconds:8.3f} s   {times:6.1f} times"
                f"   ({found.nfev} residuals; sum of squares {same:+.1e})"
            )
            # The same minimum; numeric derivatives need not come to an end.
            if jac != "2-point":
                failed |= abs(same) > 1e-6
    if failed:
        sys.exit("the two do not find the same minimum")


main()
