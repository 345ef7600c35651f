/* The machine of this page, computed here: poses by exact matrices, corrections by the tables as a controller
   evaluates them. Lengths mm, angles rad inside; positions as commands are, in mm and degrees.

   What it does follows the kinematic conventions and the format of the tables of the manual, and is compared
   with what the program wrote into the page (`compare`). It draws nothing. */
const Engine = (() => {
  "use strict";

  /** Differences that count as none: mm and rad. */
  const LIMIT = { mm: 1e-6, rad: 1e-9 };

  /* Poses are twelve numbers, three rows of [R | t]. */

  const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

  /** The pose of b, which is seen from a. */
  function times(a, b) {
    const c = new Array(12);
    for (let i = 0; i < 12; i += 4) {
      for (let j = 0; j < 4; j++) {
        c[i + j] = a[i] * b[j] + a[i + 1] * b[4 + j] + a[i + 2] * b[8 + j];
      }
      c[i + 3] += a[i + 3];
    }
    return c;
  }

  function inverse(a) {
    const t = (k) => -(a[k] * a[3] + a[4 + k] * a[7] + a[8 + k] * a[11]);
    return [a[0], a[4], a[8], t(0), a[1], a[5], a[9], t(1), a[2], a[6], a[10], t(2)];
  }

  /** A point of a pose's frame, seen from outside. */
  function point(a, p) {
    return [0, 4, 8].map((i) => a[i] * p[0] + a[i + 1] * p[1] + a[i + 2] * p[2] + a[i + 3]);
  }

  /** A direction of a pose's frame, seen from outside. */
  function turned(a, v) {
    return [0, 4, 8].map((i) => a[i] * v[0] + a[i + 1] * v[1] + a[i + 2] * v[2]);
  }

  function translation(t) {
    return [1, 0, 0, t[0], 0, 1, 0, t[1], 0, 0, 1, t[2]];
  }

  /** Trans(x, y, z) · Rx(a) · Ry(b) · Rz(c): the meaning of an error. */
  function ofError([x, y, z, a, b, c]) {
    const [sa, ca, sb, cb, sc, cc] = [a, b, c].flatMap((r) => [Math.sin(r), Math.cos(r)]);
    return [
      cb * cc,
      -cb * sc,
      sb,
      x,
      ca * sc + sa * sb * cc,
      ca * cc - sa * sb * sc,
      -sa * cb,
      y,
      sa * sc - ca * sb * cc,
      sa * cc + ca * sb * sc,
      ca * cb,
      z,
    ];
  }

  /** The twist [x y z a b c] of a small displacement. */
  function twist(m) {
    return [m[3], m[7], m[11], 0.5 * (m[9] - m[6]), 0.5 * (m[2] - m[8]), 0.5 * (m[4] - m[1])];
  }

  /* Error motions. */

  /** Linear between the points, the end value outside. */
  function interpolate(at, values, q) {
    const last = at.length - 1;
    if (q < at[0]) return values[0];
    if (q > at[last]) return values[last];
    let above = 1;
    while (above < last && at[above] <= q) above++;
    if (last === 0) return values[0];
    const t = (q - at[above - 1]) / (at[above] - at[above - 1]);
    return values[above - 1] + (values[above] - values[above - 1]) * t;
  }

  function basis(of, k, q) {
    return of === "degree" ? q ** k : of === "cosine" ? Math.cos(k * q) : Math.sin(k * q);
  }

  /** The value (mm or rad) of an error motion at q (mm or rad), coming in direction `sign`. */
  function motionAt(motion, [low, high], q, sign, kelvin) {
    if (motion.holds) q = q < low ? low : q > high ? high : q;
    let value = motion.coefficients.reduceRight((sum, c) => sum * q + c, 0);
    for (const c of motion.per_kelvin) value += c.per_kelvin * kelvin[c.sensor] * basis(c.of, c.k, q);
    motion.harmonics.forEach(([cosine, sine], i) => {
      value += cosine * Math.cos((i + 1) * q) + sine * Math.sin((i + 1) * q);
    });
    const table = motion.tabulated;
    if (table) {
      const positive = interpolate(table.at, table.positive, q);
      if (table.negative) {
        const negative = interpolate(table.at, table.negative, q);
        value += 0.5 * (positive + negative) + sign * (0.5 * (positive - negative));
      } else {
        value += positive;
      }
    }
    return value + motion.backlash * sign;
  }

  /* Tables: f32 throughout, one operation after the other, as the format says. */

  const f = Math.fround;

  /** The interval around x: indices of its points and the fraction in between. */
  function interval(span, x) {
    let d = f(x - span.start);
    if (span.modulo) {
      let p = f(d * span.inversePeriod);
      p = p < 4194304 ? p : 4194304;
      p = p > -4194304 ? p : -4194304;
      d = f(d - f(Math.floor(p) * span.period));
    }
    let u = f(d * span.inverseStep);
    u = u > 0 ? u : 0;
    if (span.modulo) u = u < span.points ? u : 0;
    else u = u < span.end ? u : span.end;
    const i = Math.trunc(u);
    return [i, i < span.last ? i + 1 : span.modulo ? 0 : span.last, f(u - i)];
  }

  function span(of, points, cubic) {
    const step = f(of.step);
    const period = f(points * step);
    return {
      start: f(of.start),
      inverseStep: f(1 / step),
      modulo: of.modulo,
      period,
      inversePeriod: f(1 / period),
      points,
      last: points - 1,
      end: cubic ? points - 3 : points - 1,
    };
  }

  const line = (a, b, t) => f(a + f(f(b - a) * t));

  function cubic(table, i, last, t) {
    const sixth = f(1 / 6);
    const [a, b, c, d] = [0, 1, 2, 3].map((k) => table[i + k <= last ? i + k : i + k - last - 1]);
    const s = f(1 - t);
    const w0 = f(sixth * f(f(s * s) * s));
    const w2 = f(sixth + f(f(0.5 * t) * f(1 + f(t * s))));
    const w3 = f(sixth * f(f(t * t) * t));
    const sum = f(f(f(w0 * f(a - b)) + f(w2 * f(c - b))) + f(w3 * f(d - b)));
    return f(b + sum);
  }

  /** What tables add to the axes (mm, deg), given all inputs and directions of the axes. */
  function evaluator(tables, axes) {
    const banks = tables.banks.map((bank) => ({
      ...bank,
      span: span(bank, bank.tables[0].length, bank.cubic),
      tables: bank.tables.map((t) => Float32Array.from(t)),
    }));
    const grids = tables.grids.map((grid) => ({
      ...grid,
      spans: grid.inputs.map((of) => span(of, of.points, false)),
      samples: Float32Array.from(grid.samples),
    }));
    const holds = {
      both: () => 1,
      positive: (s) => (s > 0 ? 1 : 0),
      negative: (s) => (s < 0 ? 1 : 0),
      signed: (s) => s,
    };
    return (inputs, signs) => {
      const values = [];
      for (const bank of banks) {
        const sign = holds[bank.direction](signs[bank.input]);
        const [i, j, t] = interval(bank.span, f(inputs[bank.input]));
        for (const table of bank.tables) {
          const value = bank.cubic ? cubic(table, i, bank.span.last, t) : line(table[i], table[j], t);
          values.push(sign === 0 ? 0 : sign < 0 && bank.direction === "signed" ? -value : value);
        }
      }
      const sums = new Array(axes).fill(0);
      for (const term of tables.terms) {
        let product = f(term.weight);
        for (const factor of term.factors) product = f(product * values[factor]);
        sums[term.output] = f(sums[term.output] + product);
      }
      for (const grid of grids) {
        // Node numbers and fraction along each input; the first varies slowest.
        const at = grid.spans.map((s, k) => interval(s, f(inputs[grid.inputs[k].input])));
        const width = grid.outputs.length;
        const read = (k, node, output) => {
          if (k === at.length) return grid.samples[node * width + output];
          const [i, j, t] = at[k];
          const first = node * grid.spans[k].points;
          return line(read(k + 1, first + i, output), read(k + 1, first + j, output), t);
        };
        grid.outputs.forEach((axis, output) => {
          sums[axis] = f(sums[axis] + read(0, 0, output));
        });
      }
      return sums;
    };
  }

  /**
   * A machine that moves.
   *
   * A state is `{ position, direction, auxiliaries }`: of each axis its command (mm, deg) and the direction
   * in which it came (1, -1, 0 if unknown); the tool length (mm) if it is an input, then temperatures (K).
   */
  class Machine {
    constructor(model) {
      this.model = model;
      const n = model.axes.length;
      this.chains = ["workpiece", "tool"].map((branch) => {
        let before = IDENTITY;
        const links = [];
        model.axes.forEach((axis, index) => {
          if (axis.carries !== branch) return;
          links.push({ index, axis, relative: times(inverse(before), axis.frame) });
          before = axis.frame;
        });
        const end = branch === "tool" ? model.spindle : model.workpiece;
        return { links, end: times(inverse(before), end) };
      });
      this.evaluate = model.tables ? evaluator(model.tables, n) : null;
    }

    /** A position of any turn of an endless axis as the same place within its travel. */
    withinTurn(index, q) {
      const {
        travel: [low, high],
        endless,
      } = this.model.axes[index];
      if (!endless || (q >= low && q <= high)) return q;
      return q - (high - low) * Math.floor((q - low) / (high - low));
    }

    /** The tool tip in the spindle frame. */
    tip(state) {
      const { tip, tool_axis: axis, length_range: range } = this.model;
      const at = [...tip];
      if (range) at[axis] = state.auxiliaries[0] * Math.sign(tip[axis]);
      return at;
    }

    /** Temperatures (K from their reference). */
    kelvin(state) {
      return state.auxiliaries.slice(this.model.length_range ? 1 : 0);
    }

    /** The location error [x y z a b c] of an axis, or of the spindle (number of axes). */
    location(index, kelvin) {
      const error = [...this.model.locations[index]];
      for (const c of this.model.locations_per_kelvin) {
        if (c.index === index) error[c.component] += c.per_kelvin * kelvin[c.sensor];
      }
      return error;
    }

    /** The error motions [x y z a b c] of an axis at q (mm or rad). */
    intra(index, q, sign, kelvin) {
      const { motions, calibrated } = this.model.axes[index];
      return motions.map((m) => (m ? motionAt(m, calibrated, q, sign, kelvin) : 0));
    }

    /**
     * Frames in the foundation frame: of each axis before and after its motion, and of both ends.
     * `wrong` changes every error before it acts; `null`: no errors. `added` (mm, deg) is added to the commands.
     */
    frames(state, wrong, added) {
      const before = [];
      const after = [];
      const kelvin = this.kelvin(state);
      const n = this.model.axes.length;
      const ends = this.chains.map(({ links, end }, branch) => {
        let frame = IDENTITY;
        for (const { index, axis, relative } of links) {
          frame = times(frame, relative);
          if (wrong) frame = times(frame, ofError(wrong(this.location(index, kelvin))));
          before[index] = frame;
          let q = axis.rotary ? state.position[index] * (Math.PI / 180) : state.position[index];
          if (added) q += axis.rotary ? added[index] * (Math.PI / 180) : added[index];
          frame = times(frame, this.moved(axis, q));
          if (wrong) frame = times(frame, ofError(wrong(this.intra(index, q, state.direction[index], kelvin))));
          after[index] = frame;
        }
        frame = times(frame, end);
        return branch === 1 && wrong ? times(frame, ofError(wrong(this.location(n, kelvin)))) : frame;
      });
      return { before, after, workpiece: ends[0], spindle: ends[1] };
    }

    /** The motion of an axis by q (mm or rad). */
    moved(axis, q) {
      const step = [0, 0, 0, 0, 0, 0];
      step[axis.component + (axis.rotary ? 3 : 0)] = axis.sense * q;
      return ofError(step);
    }

    /** The tool (spindle orientation, origin at the tip) in the workpiece frame. */
    pose(state, wrong, added) {
      const { workpiece, spindle } = this.frames(state, wrong, added);
      return times(times(inverse(workpiece), spindle), translation(this.tip(state)));
    }

    nominal(state) {
      return this.pose(state, null);
    }

    actual(state, added) {
      return this.pose(state, (error) => error, added);
    }

    /** What the tables add to the axes (mm, deg); `null` without tables. */
    correction(state) {
      return this.evaluate && this.evaluate([...state.position, ...state.auxiliaries], state.direction);
    }

    /** What is left at a state: of the tip (mm) and of the tool's direction (rad), both in the tool frame, and
     * the way of the tip as seen from the workpiece (mm). */
    left(state, added) {
      const nominal = this.nominal(state);
      const error = twist(times(inverse(nominal), this.actual(state, added)));
      const across = error.slice(3);
      across[this.model.tool_axis] = 0;
      return {
        twist: error,
        tip: Math.hypot(error[0], error[1], error[2]),
        direction: Math.hypot(...across),
        way: turned(nominal, error),
        at: [nominal[3], nominal[7], nominal[11]],
      };
    }

    /** Before, as `left`: relative to the position whose correction the tables leave out, if there is one. */
    before(state) {
      return this.left(state, this.model.zero);
    }

    /** Before, and with tables after: as `left`. */
    both(state) {
      const added = this.correction(state);
      const after =
        added &&
        this.left(
          state,
          added.map((d, k) => d + this.model.zero[k]),
        );
      return { before: this.before(state), after, added };
    }
  }

  /** How far the page is from the program at the positions that this wrote: mm, rad, and corrections that differ
   * at all. */
  function compare(machine) {
    const far = { positions: 0, mm: 0, rad: 0, corrections: 0 };
    const see = (key, a, b) => {
      const off = Math.abs(a - b);
      // What is not a number is as wrong as can be.
      far[key] = off <= far[key] ? far[key] : off >= 0 ? off : Infinity;
    };
    const seePose = (a, b) => a.forEach((v, k) => see(k % 4 === 3 ? "mm" : "rad", v, b[k]));
    const seeLeft = (a, b) => {
      a.twist.forEach((v, k) => see(k < 3 ? "mm" : "rad", v, b.twist[k]));
      see("mm", a.tip, b.tip_mm);
      see("rad", a.direction, b.direction_rad);
    };
    for (const check of machine.model.checks) {
      far.positions++;
      seePose(machine.nominal(check), check.nominal);
      seePose(machine.actual(check), check.actual);
      const { before, after, added } = machine.both(check);
      seeLeft(before, check.before);
      if (added) {
        seeLeft(after, check.after);
        if (added.some((v, k) => v !== check.correction[k])) far.corrections++;
      }
    }
    far.agrees = far.positions > 0 && far.mm <= LIMIT.mm && far.rad <= LIMIT.rad;
    return far;
  }

  return { IDENTITY, LIMIT, Machine, compare, inverse, ofError, point, times, translation, turned, twist };
})();
