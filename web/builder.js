/* The machine builder: layouts, a row for each axis, and the machine file of both. */
const Builder = (() => {
  "use strict";
  const { element } = Sliders;

  const KINDS = {
    "three axes, router": "wFYXZSt",
    "three axes, moving table": "wXYFZSt",
    "trunnion, A and C in the table": "wCAYFXZSt",
    "trunnion on a column": "wCBFXYZSt",
    "table and head": "wCYFXZBSt",
    "fork head": "wFXYZCASt",
    "gantry with fork head": "wFXYZCBSt",
  };
  const LAYOUT =
    "The layout is the chain from the workpiece w to the tool t: axes that carry the workpiece left of the foundation F, " +
    "those that carry the tool right of it. S is the spindle.";

  /** The axes of a layout, from the workpiece to the tool, or why it is none. */
  function read(layout) {
    const found = /^w([XYZUVWABC]*)[Ff]([XYZUVWABC]*)S?t$/.exec(layout.trim());
    if (!found) return `“${layout}” is no layout: write w, the axes, F, the axes, S and t, as in wCAYFXZSt.`;
    const [, workpiece, tool] = found;
    const all = [
      ...[...workpiece].map((letter) => ({ letter, branch: "workpiece" })),
      ...[...tool].map((letter) => ({ letter, branch: "tool" })),
    ];
    const twice = all.find(({ letter }, k) => all.findIndex((a) => a.letter === letter) !== k);
    return twice ? `The axis ${twice.letter} is there twice.` : all;
  }

  /** The rows of axes in the body of a table; values that have been entered stay. */
  function fill(body, axes) {
    const old = new Map([...body.rows].map((row) => [row.dataset.letter, row]));
    const all = axes.map(({ letter, branch }) => {
      const before = old.get(letter);
      const rotary = "ABC".includes(letter);
      const kept = (key) => before?.querySelector(`[data-key="${key}"]`);
      const cell = (what, value, label) =>
        element(
          "td",
          {},
          element("input", {
            type: "number",
            step: "any",
            value: kept(what)?.value ?? value,
            "data-key": what,
            "aria-label": `${letter}: ${label}`,
          }),
        );
      const range = rotary ? [-120, 120] : letter === "Z" ? [-250, 0] : [-250, 250];
      const reversed = element("input", { type: "checkbox", "data-key": "reversed", "aria-label": `${letter}: reversed` });
      reversed.checked = kept("reversed")?.checked ?? false;
      return element(
        "tr",
        { "data-letter": letter, "data-branch": branch },
        element("th", { scope: "row" }, `${letter}, ${branch}`),
        cell("from", range[0], "from"),
        cell("to", range[1], "to"),
        ...["x", "y", "z"].map((c) => cell(c, 0, `origin ${c}`)),
        element("td", {}, reversed),
      );
    });
    body.replaceChildren(...all);
  }

  /** The text of a machine file; `name` is quoted. */
  function machine(name, layout, rows, tool) {
    // The file lists each branch from the foundation outwards.
    const branch = (which) => rows.filter((row) => row.dataset.branch === which);
    const axes = [...branch("workpiece").reverse(), ...branch("tool")].map((row) => {
      const value = (key) => row.querySelector(`[data-key="${key}"]`);
      const numbers = (...keys) => `[${keys.map((key) => Number(value(key).value).toString()).join(", ")}]`;
      const origin = ["x", "y", "z"].some((key) => Number(value(key).value)) ? `\norigin_mm = ${numbers("x", "y", "z")}` : "";
      const reversed = value("reversed").checked ? "\nreversed = true" : "";
      return (
        `[[axis]]\nname = "${row.dataset.letter}"\nbranch = "${row.dataset.branch}"\n` +
        `range = ${numbers("from", "to")}${origin}${reversed}\n`
      );
    });
    return (
      `name = ${name}\ntopology = "${layout}"\n\n${axes.join("\n")}\n` +
      `[spindle]\naxis = "z"\n\n[tool]\ntip_mm = [0, 0, ${-tool}]\n`
    );
  }

  return { KINDS, LAYOUT, read, fill, machine };
})();
