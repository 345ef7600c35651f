/* The machine as its description has it, drawn: slides, rotary axes, spindle, tool, table and workpiece.

   Where the tool, the workpiece and the rotary axes are is true; how slides look and where beside them they stand
   is made up, for a description says nothing about that. */
const Drawing = (() => {
  "use strict";
  const { add, sub, dot, across, length, ring } = Scene;
  const { inverse, times, ofError, point, turned } = Engine;

  /** Largest errors that are drawn: a part of the machine's size, and rad. */
  const LARGEST = { length: 0.3, angle: 0.5 };

  const corners = (ranges) =>
    ranges.reduce((all, range) => all.flatMap((c) => range.map((v) => [...c, v])), [[]]);

  class Drawing {
    constructor(machine) {
      this.machine = machine;
      const model = machine.model;
      this.axes = model.axes.map((axis, index) => {
        const direction = turned(
          axis.frame,
          [0, 1, 2].map((k) => (k === axis.component ? axis.sense : 0)),
        );
        return { ...axis, index, direction, origin: [3, 7, 11].map((k) => axis.frame[k]) };
      });
      const column = (frame, k) => [frame[k], frame[4 + k], frame[8 + k]];
      const side = model.tip[model.tool_axis] > 0 ? -1 : 1;
      this.up = column(model.spindle, model.tool_axis).map((v) => v * side);
      const linear = this.axes.filter((a) => !a.rotary);
      this.size = Math.max(...linear.map((a) => a.travel[1] - a.travel[0]));
      this.reach();
      Object.assign(this, layOut(this));
      this.goHome();
    }

    /** Puts the tip a little above a table that turns, as far as the travel goes. */
    goHome() {
      if (!this.axes.some((a) => a.rotary && a.carries === "workpiece")) return;
      const { model } = this.machine;
      const tip = (position) =>
        point(
          model.workpiece,
          [3, 7, 11].map((k) => this.machine.nominal({ ...this.home, position })[k]),
        );
      const wanted = add(this.table, this.up, 0.14 * this.size);
      for (const {
        index,
        travel: [low, high],
      } of [...this.axes, ...this.axes].filter((a) => !a.rotary)) {
        const { position } = this.home;
        const now = tip(position);
        const way = sub(tip(position.map((q, k) => (k === index ? q + 1 : q))), now);
        const q = position[index] + dot(sub(wanted, now), way);
        position[index] = Math.round(Math.max(low, Math.min(high, q)) * 10) / 10;
      }
    }

    /** Where the axes are at first, linear ones halfway, and all corners that the tip reaches from there. */
    reach() {
      const { model } = this.machine;
      const at = model.axes.map(({ rotary, travel: [low, high] }) =>
        rotary ? Math.max(low, Math.min(high, 0)) : 0.5 * (low + high),
      );
      const auxiliaries = (model.length_range ? [Math.abs(model.tip[model.tool_axis])] : []).concat(
        model.sensors.map(() => 0),
      );
      const linear = this.axes.filter((a) => !a.rotary);
      this.home = { position: at, direction: at.map(() => 0), auxiliaries };
      this.tips = corners(linear.map((a) => a.travel)).map((ends) => {
        const position = [...at];
        linear.forEach((a, k) => (position[a.index] = ends[k]));
        return point(
          model.workpiece,
          [3, 7, 11].map((k) => this.machine.nominal({ ...this.home, position })[k]),
        );
      });
    }

    /** Poses that move shapes from where they are at zero. */
    moves(frames) {
      const { model } = this.machine;
      const from = (now, zero) => times(now, inverse(zero));
      return {
        base: Engine.IDENTITY,
        workpiece: from(frames.workpiece, model.workpiece),
        spindle: from(frames.spindle, model.spindle),
        before: frames.before.map((f, k) => from(f, model.axes[k].frame)),
        after: frames.after.map((f, k) => from(f, model.axes[k].frame)),
      };
    }

    /** Errors, so many times as large, but not more than can be drawn. */
    exaggerate(times) {
      const most = [LARGEST.length * this.size, LARGEST.angle];
      this.cut = false;
      return (error) =>
        error.map((e, k) => {
          const limit = most[k < 3 ? 0 : 1];
          if (Math.abs(e * times) > limit) this.cut = true;
          return Math.max(-limit, Math.min(limit, e * times));
        });
    }

    /** How many times errors are first drawn: so that the tip goes a quarter of the machine's size. */
    suited(states) {
      const most = Math.max(...states.map((s) => this.machine.before(s).tip));
      const angle = Math.max(
        ...states.map((s) =>
          this.machine
            .before(s)
            .twist.slice(3)
            .reduce((m, v) => Math.max(m, Math.abs(v)), 0),
        ),
      );
      const fits = Math.min((0.25 * this.size) / most, 0.35 / angle, 5000);
      const power = 10 ** Math.floor(Math.log10(fits));
      const rounded = [5, 2, 1].map((k) => k * power).find((k) => k <= fits);
      return Number.isFinite(rounded) ? Math.max(1, rounded) : 1;
    }

    /** Points that the picture ought to hold, wherever axes are. */
    extent() {
      const linear = this.axes.filter((a) => !a.rotary);
      const states = corners(linear.map((a) => a.travel)).map((ends) => {
        const position = [...this.home.position];
        linear.forEach((a, k) => (position[a.index] = ends[k]));
        return { ...this.home, position };
      });
      return states.flatMap((state) => {
        const moves = this.moves(this.machine.frames(state, null));
        const shapes = this.parts.flatMap(({ body, faces }) =>
          faces.flatMap((f) => f.points.map((p) => point(this.of(moves, body), p))),
        );
        const rails = this.rails.flatMap(({ axis, place }) =>
          axis.travel.map((q) => point(this.of(moves, ["before", axis.index]), add(place, axis.direction, q))),
        );
        return [...shapes, ...rails];
      });
    }

    of(moves, body) {
      return Array.isArray(body) ? moves[body[0]][body[1]] : moves[body];
    }

    /** The picture of a state, with errors so many times as large. `added` (mm, deg) is added to the commands. `over` draws
     * in place of the error of the tip, on frames with errors; then nothing but the letters of axes is written. */
    draw(view, state, exaggeration, { added = null, over = null } = {}) {
      const picture = new Scene.Picture(view);
      const { machine, size } = this;
      const wrong = this.exaggerate(exaggeration);
      const kelvin = machine.kelvin(state);
      const right = machine.frames(state, null);
      const ideal = this.moves(right);
      const frames = machine.frames(state, wrong, added);
      const actual = this.moves(frames);
      const apart = over || machine.model.checks.some((c) => c.before.tip_mm > 0 || c.before.direction_rad > 0);

      for (const { body, faces } of this.parts) {
        if (apart && body !== "base") picture.outline(faces, (p) => point(this.of(ideal, body), p), "ideal");
      }
      picture.parts.push(...picture.over.splice(0).map((svg) => [Infinity, svg]));
      for (const { body, faces } of this.parts) {
        const pose = this.of(actual, body);
        // The tool has the length that it is set to.
        picture.solid(faces, (p) => point(pose, body === "spindle" ? this.lengthened(p, state) : p));
      }
      for (const { axis, place, side, style, centre, isSecond } of this.rails) {
        const before = this.of(actual, ["before", axis.index]);
        const [low, high] = axis.travel;
        // The way of the carriage with its error motions.
        const at = (k) => {
          const q = low + ((high - low) * k) / 24;
          const frame = times(axis.frame, machine.moved(axis, q));
          const error = ofError(wrong(machine.intra(axis.index, q, state.direction[axis.index], kelvin)));
          return times(times(before, times(frame, error)), inverse(axis.frame));
        };
        for (const s of [-1, 1]) {
          picture.line(
            Array.from({ length: 25 }, (_, k) => point(at(k), add(place, side, s))),
            `rail ${style}`,
          );
        }
        if (isSecond) continue;
        [low, high].forEach((value, k) => {
          if (over) return;
          const ends = [at(0), at(24)].map((pose) => point(pose, place));
          picture.label(ends[k], `${axis.letter} ${value}`, "limit", ends[1 - k], 8);
        });
        const carriage = this.of(actual, ["after", axis.index]);
        const arrow = [0.07, 0.24].map((k) => point(carriage, add(centre, axis.direction, k * size)));
        picture.arrow(arrow, `sense ${style}`, 10);
        picture.label(arrow[1], over ? axis.letter : `+${axis.letter}`, `letter ${style}`, arrow[0], 13);
      }
      for (const { axis, centre, radius, head } of this.turns) {
        const before = this.of(actual, ["before", axis.index]);
        const move = (p) => point(before, p);
        const arm = axis.rotary && add(axis.origin, axis.direction, -0.3 * size);
        picture.above([arm, add(axis.origin, axis.direction, 0.3 * size)].map(move), "centre-line");
        const style = axis.carries;
        const [x, y] = across(axis.direction).map((d) => dot(d, head));
        const [end, turn] = [Math.atan2(y, x), 4.3];
        const arc = ring(centre, axis.direction, radius, 22, end - turn, turn).map(move);
        picture.arrow(arc, `sense ${style}`, 10);
        picture.label(arc[21], over ? axis.letter : `+${axis.letter}`, `letter ${style}`, move(centre), 14);
        const turnedBy = this.of(actual, ["after", axis.index]);
        const [u] = across(axis.direction);
        picture.above(
          [centre, add(centre, u, radius)].map((p) => point(turnedBy, p)),
          `mark ${style}`,
        );
      }
      if (over) {
        over(picture, frames);
        return picture.svg();
      }
      const piece = this.of(actual, "workpiece");
      const origin = [3, 7, 11].map((k) => machine.model.workpiece[k]);
      ["x", "y", "z"].forEach((name, k) => {
        const column = [
          machine.model.workpiece[k],
          machine.model.workpiece[4 + k],
          machine.model.workpiece[8 + k],
        ];
        const arrow = [origin, add(origin, column, 0.13 * size)].map((p) => point(piece, p));
        picture.arrow(arrow, "frame", 6);
        picture.label(arrow[1], name, "frame", arrow[0], 8);
      });
      this.error(picture, state, right, exaggeration);
      return picture.svg();
    }

    /** A point of the tool below the spindle, where a tool of the set length has it. */
    lengthened(p, state) {
      const { model } = this.machine;
      if (!model.length_range) return p;
      const k = model.tool_axis;
      const inside = point(inverse(model.spindle), p);
      const below = inside[k] * model.tip[k];
      if (below > 0) inside[k] *= Math.abs(this.machine.tip(state)[k] / model.tip[k]);
      return point(model.spindle, inside);
    }

    /** Where the tip goes wrong, seen from the workpiece, at the ideal tip. */
    error(picture, state, frames, exaggeration) {
      const tip = point(frames.spindle, this.machine.tip(state));
      const { before, after } = this.machine.both(state);
      for (const [left, style] of [
        [before, "before"],
        [after, "after"],
      ]) {
        if (!left) continue;
        const way = turned(frames.workpiece, left.way).map((v) => v * exaggeration);
        const size = length(way);
        const shown =
          size > LARGEST.length * this.size ? way.map((v) => (v * LARGEST.length * this.size) / size) : way;
        if (shown !== way) this.cut = true;
        if (length(shown) * picture.view.scale > 1.5) picture.arrow([tip, add(tip, shown)], `off ${style}`, 8);
      }
      picture.dot(tip, 3, "tip");
    }
  }

  return Drawing;
})();
