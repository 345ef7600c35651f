// The page's own computations beside the program's, at random positions that the program has not written into it.

import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";

const COUNT = 1000;
/** What the page may differ by: mm, rad. */
const [MM, RAD] = [1e-6, 1e-9];

/** Numbers between 0 and 1 that are the same each time. */
function seeded(seed) {
  let s = seed;
  return () => {
    s = (Math.imul(s, 1664525) + 1013904223) >>> 0;
    return s / 4294967296;
  };
}

/** Rows of positions, which as a motion have directions, and these. */
function draw({ axes, length_range: length, sensors }) {
  const random = seeded(2026);
  const between = ([low, high]) => low + (high - low) * random();
  const rows = [];
  let last = null;
  while (rows.length < COUNT) {
    // The last degree of a turn is left out: what is corrected must stay within the turn.
    const position = axes.map(({ travel: [low, high], endless }) =>
      endless ? between([low + 1, high - 1]) : between([low, high]),
    );
    const moves = position.map((q, i) => {
      const d = last ? q - last[i] : 0;
      return axes[i].endless ? d - 360 * Math.round(d / 360) : d;
    });
    // Far enough for a direction, and of an endless axis not half a turn, which has none.
    if (last && moves.some((d, i) => Math.abs(d) < 1 || (axes[i].endless && Math.abs(d) > 175))) continue;
    const auxiliaries = [...(length ? [between(length)] : []), ...sensors.map((s) => between(s.range_kelvin))];
    rows.push({ position, direction: moves.map((d) => Math.sign(d)), auxiliaries });
    last = position;
  }
  return rows;
}

/** Arrows point, and lie, where the program says that a positive command leads. */
export async function pointsRight(page, report, trueaxis, fault) {
  const [at] = ask(trueaxis, "pose", report.machine).poses;
  const drawn = await page.evaluate(() => {
    const { drawing, machine } = window.trueaxis;
    const zero = { ...drawing.home, position: drawing.axes.map(() => 0) };
    // Of a slide how far the carriage really goes in the picture, of a rotary axis what its arrow goes around.
    return drawing.axes.map((axis, i) => {
      const place = (q) => {
        const position = zero.position.map((z, k) => (k === i ? q : z));
        return Engine.point(drawing.moves(machine.frames({ ...zero, position }, null)).after[i], axis.origin);
      };
      const moved = Scene.sub(place(1), place(0));
      return {
        letter: axis.letter,
        direction: axis.direction,
        moved: axis.rotary ? null : moved,
        origin: axis.origin,
      };
    });
  });
  for (const [i, { letter, direction, moved, origin }] of drawn.entries()) {
    const line = at.axes[i];
    const off = (a, b) => Math.hypot(...a.map((v, k) => v - b[k]));
    if (line.axis !== letter || off(direction, line.direction) > 1e-12)
      fault(`+${letter} points along ${direction}`);
    if (moved && off(moved, line.direction) > 1e-9) fault(`+${letter} moves along ${moved}`);
    if (off(origin, line.point) > 1e-9) fault(`${letter} lies at ${origin}, not at ${line.point}`);
  }
}

/** What a command answers. */
function ask(trueaxis, ...words) {
  const options = { encoding: "utf8", maxBuffer: 1 << 28, stdio: ["ignore", "pipe", "ignore"] };
  return JSON.parse(execFileSync(trueaxis, [...words, "--json"], options));
}

/** Poses, corrections, and what is left with them. */
export async function agreesEverywhere(page, report, trueaxis, folder, fault) {
  const machine = await page.evaluate(() => {
    const { axes, length_range, sensors } = window.trueaxis.machine.model;
    return {
      axes: axes.map(({ letter, travel, endless }) => ({ letter, travel, endless })),
      length_range,
      sensors,
    };
  });
  const rows = draw(machine);
  const names = [
    ...machine.axes.map((a) => a.letter),
    ...(machine.length_range ? ["tool length"] : []),
    ...machine.sensors.map((s) => s.name),
  ];
  const write = (name, positions) => {
    const file = join(folder, `${report.name}-${name}.csv`);
    writeFileSync(
      file,
      [names.join(","), ...rows.map((row, k) => [...positions[k], ...row.auxiliaries].join(","))].join("\n") +
        "\n",
    );
    return file;
  };
  const here = write(
    "positions",
    rows.map((r) => r.position),
  );
  const poses = ask(trueaxis, "pose", report.machine, report.errors, "--positions", here).poses;
  let corrections = null;
  let corrected = null;
  if (report.blob) {
    corrections = ask(trueaxis, "eval", report.blob, "--positions", here).corrections;
    // f32 as written is the nearest of its decimals.
    corrections = corrections.map((row) => row.map(Math.fround));
    const there = write(
      "corrected",
      rows.map((r, k) => r.position.map((q, i) => q + corrections[k][i])),
    );
    corrected = ask(trueaxis, "pose", report.machine, report.errors, "--positions", there).poses;
  }
  const far = await page.evaluate(
    ({ rows, poses, corrections, corrected }) => {
      const { machine } = window.trueaxis;
      const { model } = machine;
      const side = model.tip[model.tool_axis] > 0 ? -1 : 1;
      const far = { mm: 0, rad: 0, corrections: 0 };
      const see = (key, off) => (far[key] = off <= far[key] ? far[key] : off >= 0 ? off : Infinity);
      const pose = (p, tool) =>
        [0, 1, 2].forEach((k) => {
          see("mm", Math.abs(p[4 * k + 3] - tool.tip[k]));
          see("rad", Math.abs(side * p[4 * k + model.tool_axis] - tool.direction[k]));
        });
      rows.forEach((state, row) => {
        pose(machine.nominal(state), poses[row].nominal);
        pose(machine.actual(state), poses[row].actual);
        const way = (left, tool) =>
          left.way.forEach((v, k) => see("mm", Math.abs(v - (tool.actual.tip[k] - poses[row].nominal.tip[k]))));
        const { before, after, added } = machine.both(state);
        way(before, poses[row]);
        if (!corrections) return;
        way(after, corrected[row]);
        if (added.some((v, k) => v !== corrections[row][k])) far.corrections++;
      });
      return far;
    },
    { rows, poses, corrections, corrected },
  );
  if (!(far.mm <= MM) || !(far.rad <= RAD))
    fault(`at ${COUNT} positions it differs from the program by ${far.mm} mm and ${far.rad} rad`);
  if (far.corrections)
    fault(`at ${far.corrections} of ${COUNT} positions corrections differ from those of the runtime`);
  return far;
}
