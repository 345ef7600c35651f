/* Where the parts of a machine are drawn, all axes at zero: slides beside what they carry, one behind the other from
   both ends of the chain to the foundation, rotary axes where they are. */
const layOut = (() => {
  "use strict";
  const { add, sub, dot, unit, across, length, beam, box, cone } = Scene;
  const { point } = Engine;

  /** Shapes in the foundation frame at zero, each with the body that it belongs to (`base`, `workpiece`,
   * `spindle`, or the frame `before` or `after` an axis); rails and turns of axes; the middle of the table. */
  return (drawing) => {
    const spread = Math.max(
      ...[0, 1, 2].map(
        (k) => Math.max(...drawing.tips.map((p) => p[k])) - Math.min(...drawing.tips.map((p) => p[k])),
      ),
    );

    const { up, size, tips } = drawing;
    const { model } = drawing.machine;
    const w = 0.035 * size;
    const step = 0.085 * size;
    const piece = 0.12 * size;
    const parts = [];
    /** Part of `body`: the frame `before` or `after` an axis, or an end of the chain. */
    const put = (body, faces) => parts.push({ body, faces });
    const rails = [];
    const turns = [];
    const horizontal = Math.abs(up[1]) < 0.9 ? [0, 1, 0] : [0, 0, 1];
    const back = unit(add(horizontal, up, -dot(horizontal, up)));
    const along = (a, b) => Math.abs(dot(a, b));

    const below = drawing.axes.filter((a) => a.carries === "workpiece");
    const tool = drawing.axes.filter((a) => a.carries === "tool");
    const turning = below.filter((a) => a.rotary);
    const heights = tips.map((p) => dot(p, up));
    const middle = [0, 1, 2].map(
      (k) => 0.5 * (Math.min(...tips.map((p) => p[k])) + Math.max(...tips.map((p) => p[k]))),
    );
    const flat = (p, height) => add(p, up, height - dot(p, up));

    /* The table: a disc on the last rotary axis, or a plate under all that the tool reaches. */
    const end = "workpiece";
    const disc = turning.length ? turning[turning.length - 1] : null;
    const radius = Math.min(0.2 * size, 0.6 * spread);
    const table = disc ? disc.origin : flat(middle, Math.min(...heights) - 0.01 * size);
    const [u, v] = across(up);
    if (disc) {
      const a =
        along(disc.direction, up) > 0.3
          ? disc.direction.map((x) => x * Math.sign(dot(disc.direction, up)))
          : up;
      put(end, cone(add(table, a, -0.8 * w), a, radius, radius, 0.8 * w, "workpiece", 28));
      const [p, q] = across(a);
      put(
        end,
        box(
          add(table, a, 0.04 * size),
          [p.map((x) => x * 0.07 * size), q.map((x) => x * 0.05 * size), a.map((x) => x * 0.04 * size)],
          "piece",
        ),
      );
      put(
        end,
        box(
          add(add(table, a, 0.02 * size), p, 0.1 * size),
          [p.map((x) => x * 0.03 * size), q.map((x) => x * 0.02 * size), a.map((x) => x * 0.02 * size)],
          "piece",
        ),
      );
    } else {
      const half = [u, v].map((d) =>
        d.map(
          (x) =>
            x *
            0.5 *
            Math.max(
              0.1 * size,
              Math.max(...tips.map((p) => dot(p, d))) - Math.min(...tips.map((p) => dot(p, d))),
            ),
        ),
      );
      const plate = box(add(table, up, -0.5 * w), [...half, up.map((x) => x * 0.5 * w)], "workpiece");
      // One that does not move is below everything.
      put(end, below.length ? plate : plate.map((f) => ({ ...f, isFloor: true })));
      put(
        end,
        box(
          add(table, up, 0.04 * size),
          [u.map((x) => x * 0.09 * size), v.map((x) => x * 0.06 * size), up.map((x) => x * 0.04 * size)],
          "piece",
        ),
      );
    }

    /* Spindle and tool. */
    const nose = [3, 7, 11].map((k) => model.spindle[k]);
    const tip = point(model.spindle, model.tip);
    const reaches = length(sub(tip, nose));
    put("spindle", cone(nose, up, 0.045 * size, 0.045 * size, 0.13 * size, "tool"));
    if (reaches > 0) {
      const down = unit(sub(tip, nose));
      put("spindle", cone(nose, down, 0.02 * size, 0.014 * size, 0.75 * reaches, "cutter", 14));
      put(
        "spindle",
        cone(add(nose, down, 0.75 * reaches), down, 0.014 * size, 0, 0.25 * reaches, "cutter", 14),
      );
    }

    /* A portal: the first axis of the tool moves level and carries another level one across. Two columns stand beside the
         table on a rail each. */
    const isPortal = (axis, axes) =>
      axis === axes[0] &&
      axis.carries === "tool" &&
      axes.length > 1 &&
      !axes[1].rotary &&
      [axis, axes[1]].every((a) => along(a.direction, up) < 0.3) &&
      along(axis.direction, axes[1].direction) < 0.3;
    const portal = (axis, cross, style, beamAt, held) => {
      const own = ["after", axis.index];
      const [low, high] = cross.travel;
      const room = 0.07 * size;
      const tops = [low - room, high + room].map((q) => add(beamAt, cross.direction, q));
      put(own, beam(tops[0], tops[1], 0.8 * w, style, piece));
      put(own, beam(beamAt, held, 0.8 * w, style, piece));
      const level = dot(table, up) - 0.4 * w;
      return tops.map((top, k) => {
        const foot = flat(top, level);
        put(own, beam(foot, top, 1.1 * w, style, piece));
        put(
          own,
          box(
            foot,
            [
              axis.direction.map((d) => d * 0.07 * size),
              cross.direction.map((d) => d * 0.025 * size),
              up.map((d) => d * 0.02 * size),
            ],
            style,
          ),
        );
        const rail = add(foot, up, -0.022 * size);
        const side = cross.direction.map((d) => d * 0.02 * size);
        rails.push({ axis, place: rail, centre: add(foot, up, 0.02 * size), side, style, isSecond: k > 0 });
        const ends = axis.travel.map((q) => add(add(rail, axis.direction, q), up, -1.2 * w));
        put("base", beam(ends[0], ends[1], w, "bed", piece));
        return add(ends[0], sub(ends[1], ends[0]), 0.5);
      });
    };

    /* Axes, from the ends to the foundation: each is placed beside the one that it carries. `held` is where what
         it carries is fastened to it. */
    const chain = (axes, style, anchor, outwards) => {
      let held = anchor;
      let place = anchor;
      for (const axis of [...axes].reverse()) {
        const own = ["after", axis.index];
        const before = ["before", axis.index];
        if (axis.rotary) {
          const tilt = along(axis.direction, up);
          const isDisc = axis === disc;
          const r = axis.carries === "workpiece" ? radius : 0.07 * size;
          let centre;
          if (tilt > 0.9) {
            centre = isDisc
              ? add(axis.origin, up, -0.8 * w)
              : flat(axis.origin, dot(place, up) + outwards * step * 0.6);
            const a = axis.direction.map((x) => x * Math.sign(dot(axis.direction, up)));
            if (!isDisc) {
              put(own, cone(add(centre, a, -0.3 * w), a, 0.9 * r, 0.9 * r, 0.6 * w, style, 24));
              put(own, beam(centre, held, w, style, piece));
            }
            const foot = add(centre, a, outwards * 0.9 * w);
            put(before, cone(add(foot, a, -0.45 * w), a, 0.62 * r, 0.62 * r, 0.9 * w, style, 24));
            turns.push({
              axis,
              centre: isDisc ? add(axis.origin, up, 0.1 * w) : centre,
              radius: isDisc ? 0.86 * r : 1.25 * r,
              head: back.map((x) => -x),
            });
            held = foot;
            place = add(foot, up, outwards * 0.5 * w);
          } else {
            // A trunnion or a fork: bearings on both sides, a bridge between them.
            const arm = (axis.carries === "workpiece" ? 1.3 : 1.5) * r;
            const ends = [1, -1].map((s) => add(axis.origin, axis.direction, s * arm));
            const bridge = axis.carries === "workpiece" ? -1 : 1;
            for (const e of ends) {
              const inwards = unit(sub(axis.origin, e));
              put(
                own,
                cone(
                  add(e, inwards, 0.05 * size),
                  inwards,
                  0.045 * size,
                  0.045 * size,
                  -0.05 * size,
                  style,
                  16,
                ).map((x) => ({ ...x, points: [...x.points].reverse() })),
              );
              if (axis.carries === "workpiece") {
                const low = add(
                  add(e, inwards, 0.03 * size),
                  up,
                  bridge * Math.max(step * 0.9, dot(sub(e, held), up) + 0.4 * w),
                );
                put(own, beam(add(e, inwards, 0.03 * size), low, w, style, piece));
                put(own, beam(low, flat(held, dot(low, up)), w, style, piece));
              } else {
                put(own, beam(add(e, inwards, 0.02 * size), held, w, style, piece));
              }
            }
            const outer = ends.map((e) => add(e, unit(sub(e, axis.origin)), 0.7 * w));
            const level =
              axis.carries === "workpiece"
                ? Math.min(...outer.map((e) => dot(e, up)), dot(held, up)) - 1.9 * step
                : Math.max(dot(place, up), ...outer.map((e) => dot(e, up))) + 1.6 * step;
            const feet = outer.map((e) => flat(e, level));
            outer.forEach((e, k) => {
              put(
                before,
                box(
                  e,
                  [
                    axis.direction.map((x) => x * 0.35 * w),
                    ...across(axis.direction).map((d) => d.map((x) => x * 1.5 * w)),
                  ],
                  style,
                ),
              );
              put(before, beam(e, feet[k], 1.1 * w, style, piece));
            });
            put(before, beam(feet[0], feet[1], 1.1 * w, style, piece));
            turns.push({ axis, centre: ends[0], radius: 0.1 * size, head: up });
            held = add(feet[0], sub(feet[1], feet[0]), 0.5);
            place = held;
          }
          continue;
        }
        if (isPortal(axis, axes)) return portal(axis, axes[1], style, place, held);
        // A slide: its rail beside what it carries, its carriage on it.
        const isUp = along(axis.direction, up) > 0.7;
        const isBack = along(axis.direction, back) > 0.7;
        const way = axis.carries === "workpiece" ? (isUp ? back : up.map((x) => -x)) : isBack ? up : back;
        const far = axis.carries === "workpiece" && isUp ? radius + step : step;
        place = add(place, way, far);
        if (axis.carries === "workpiece" && !isUp && !turning.length && axis === axes[axes.length - 1])
          place = add(place, way, 0.3 * step);
        const [x, y] = [axis.direction, unit(Scene.cross(axis.direction, way))];
        put(
          own,
          box(
            place,
            [x.map((d) => d * 0.055 * size), y.map((d) => d * 0.045 * size), way.map((d) => d * 0.02 * size)],
            style,
          ),
        );
        put(own, beam(add(place, way, -0.02 * size), held, w, style, piece));
        const rail = add(place, way, 0.022 * size);
        rails.push({ axis, place: rail, centre: place, side: y.map((d) => d * 0.035 * size), style });
        // What carries the rail holds it where the axis is halfway.
        const [low, high] = axis.travel;
        held = add(rail, axis.direction, 0.5 * (low + high));
        place = rail;
      }
      return [held];
    };
    const [bedTable] = chain(below, "workpiece", add(table, up, -0.5 * w), -1);
    const bedTools = chain(tool, "tool", add(nose, up, 0.1 * size), 1);

    /* The bed, and the column that carries the tool branch. */
    const lowest = Math.min(dot(bedTable, up), dot(table, up)) - 0.05 * size;
    // The rails of a portal lie beside the table.
    for (const bedTool of bedTools.length > 1 ? [] : bedTools) {
      const foot = flat(bedTool, lowest);
      put("base", beam(flat(bedTable, lowest), foot, 0.07 * size, "bed", piece));
      put("base", beam(foot, bedTool, 0.06 * size, "bed", piece));
    }
    if (below.length) put("base", beam(flat(bedTable, lowest), bedTable, 0.05 * size, "bed", piece));
    return { parts, rails, turns, table };
  };
})();
