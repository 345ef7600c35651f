/* The page: files in, commands in a worker, what they say and write out. Texts of files become text, never markup. */
(() => {
  "use strict";
  const { element } = Sliders;
  const $ = (id) => document.getElementById(id);

  /** Largest file, and all files together, in bytes. */
  const MOST = 20e6;
  /** Largest text that can be edited here. */
  const MOST_EDITED = 500e3;
  /** Milliseconds after which a change is looked at. */
  const REST = 500;

  const encode = (text) => new TextEncoder().encode(text);
  const decode = (bytes) => new TextDecoder().decode(bytes);

  /* The worker. */

  /** The command, compressed in the page. */
  const wasm = (async () => {
    const text = atob($("wasm").textContent.trim());
    const packed = Uint8Array.from(text, (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  })();
  const address = URL.createObjectURL(new Blob([$("worker").textContent], { type: "text/javascript" }));
  let worker = null;
  let waiting = new Map();
  let calls = 0;

  async function start() {
    const bytes = await wasm;
    const made = new Worker(address);
    made.postMessage({ wasm: bytes });
    made.onmessage = ({ data: { id, progress, said, done, sent } }) => {
      if (sent) return send(sent);
      const call = waiting.get(id);
      if (progress !== undefined) call?.progress(progress);
      if (said !== undefined) call?.print(said);
      if (!done) return;
      waiting.delete(id);
      call?.resolve(done);
    };
    made.onerror = (event) => {
      for (const { resolve } of waiting.values())
        resolve({ code: 101, out: "", err: `error: ${event.message}\n`, files: {} });
      waiting = new Map();
      worker = null;
    };
    return made;
  }

  /** Runs a command; files are all of the page's, and these. `null` if it was cancelled. With a port, it can use it. */
  async function run(args, more = {}, progress = () => {}, print = () => {}, isOnPort = false) {
    worker ??= start();
    const id = ++calls;
    const inputs = { ...Object.fromEntries([...files].map(([name, { bytes }]) => [name, bytes])), ...more };
    return new Promise((resolve) => {
      waiting.set(id, { resolve, progress, print });
      worker.then((made) => waiting.has(id) && made.postMessage({ id, args, files: inputs, isOnPort }));
    });
  }

  /** Ends the worker with whatever it is doing. */
  function stop() {
    worker?.then((made) => made.terminate());
    worker = null;
    const all = [...waiting.values()];
    waiting = new Map();
    for (const { resolve } of all) resolve(null);
  }

  /* Files. */

  /** Names to `{ bytes, role }`. */
  const files = new Map();
  let shown = null;

  /** What a file is for, by what is in it. */
  function roleOf(name, bytes) {
    const head = decode(bytes.subarray(0, 100e3));
    if (/\.toml$/i.test(name)) {
      if (/^\s*\[\[axis\]\]/m.test(head)) return "machine";
      if (/^\s*\[(\[ball\]|\[bar\]|stylus\])/m.test(head)) return "artefact";
      return /^\s*\[(parameters|tabulated|thermal)/m.test(head) ? "errors" : "setup";
    }
    if (/\.csv$/i.test(name)) {
      if (/^\s*#\s*(reads|reads_along|axis)\b/m.test(head)) return "runs";
      return /^\s*ball\s*,/m.test(head) ? "probings" : "data";
    }
    return /\.(ngc|nc|mpf|spf|tap|cnc|gcode|txt)$/i.test(name) ? "program" : "data";
  }

  const of = (role) => [...files.keys()].filter((name) => files.get(name).role === role);
  /** A name as an argument: never an option. */
  const word = (name) => (name.startsWith("-") ? `./${name}` : name);
  const last = (role) => {
    const name = of(role).pop();
    return name === undefined ? null : word(name);
  };

  function put(name, bytes) {
    files.delete(name);
    files.set(name, { bytes, role: roleOf(name, bytes) });
  }

  /** Takes files that were dropped or chosen. */
  async function take(list) {
    const all = [...list];
    const size = [...files.values()].reduce((sum, { bytes }) => sum + bytes.length, 0);
    const large = all.find((file) => file.size > MOST || size + file.size > MOST);
    if (large) {
      problem(
        `${large.name} is not opened: ${(large.size / 1e6).toFixed(0)} MB; this page takes ${MOST / 1e6} MB in all.\n` +
          "Use the command trueaxis for larger files.",
      );
      return;
    }
    for (const file of all) {
      const bytes = new Uint8Array(await file.arrayBuffer());
      const role = roleOf(file.name, bytes);
      // One machine, one set of errors.
      if (["machine", "errors", "artefact", "setup"].includes(role)) of(role).forEach((old) => files.delete(old));
      put(file.name, bytes);
      shown = file.name;
    }
    $("example").value = "";
    changed();
  }

  function example(name) {
    files.clear();
    for (const [file, text] of Object.entries(examples[name].files)) put(file, encode(text));
    const given = examples[name].options.split(" ");
    for (const id of ["policy", "scheme", "tolerance"])
      $(id).value = given.includes(`--${id}`) ? given[given.indexOf(`--${id}`) + 1] : "";
    for (const id of ["best-effort", "allow-large"]) $(id).checked = given.includes(`--${id}`);
    shown = last("machine");
    changed();
  }

  /** Shows the files, and what can be done with them. */
  function changed() {
    if (!files.has(shown)) shown = [...files.keys()][0] ?? null;
    tabs();
    edit();
    const has = (role) => of(role).length > 0;
    const needs = {
      compile: has("machine") && has("errors"),
      draw: has("machine") && has("errors"),
      identify: has("machine") && has("probings"),
      measured: has("machine") && has("runs"),
    };
    for (const [id, met] of Object.entries(needs)) $(id).disabled = !met || busy;
    controllable();
    const programs = of("program").map((name) => element("option", {}, name));
    $("program").replaceChildren(...programs);
    $("gcode").disabled = !programs.length;
    check();
  }

  function tabs() {
    const all = [...files].map(([name, { role }]) => {
      const button = element(
        "button",
        { type: "button", role: "tab", "aria-selected": String(name === shown), "aria-controls": "editor" },
        name,
        role === "data" ? "" : ` (${role})`,
      );
      button.addEventListener("click", () => {
        shown = name;
        tabs();
        edit();
        mark();
      });
      return button;
    });
    $("tabs").replaceChildren(...all);
  }

  function edit() {
    $("editor").hidden = shown === null;
    if (shown === null) return;
    const { bytes } = files.get(shown);
    const isLong = bytes.length > MOST_EDITED;
    $("text").readOnly = isLong;
    $("text").value = decode(isLong ? bytes.subarray(0, MOST_EDITED) : bytes);
    numbers();
  }

  /** Line numbers, one of them marked. */
  function numbers(bad = 0) {
    const count = $("text").value.split("\n").length;
    const range = (from, to) => {
      let text = "";
      for (let k = from; k <= to; k++) text += `${k}\n`;
      return text;
    };
    const parts = bad ? [range(1, bad - 1), element("b", {}, `${bad}`), `\n${range(bad + 1, count)}`] : [range(1, count)];
    $("numbers").replaceChildren(...parts);
    $("numbers").scrollTop = $("text").scrollTop;
  }

  /* Problems, at their line. */

  /** Where the last problem is: `{ name, line, column }`. */
  let place = null;

  function problem(text) {
    $("problem").replaceChildren(...(text ? [element("pre", {}, text.trim())] : []));
  }

  /** Marks the place of the problem, if it is in the file shown. */
  function mark() {
    const here = place?.name === shown;
    $("text").setAttribute("aria-invalid", String(here));
    numbers(here ? place.line : 0);
    if (!here) return;
    const box = $("text");
    const line = parseFloat(getComputedStyle(box).lineHeight);
    box.scrollTop = Math.max(0, (place.line - 5) * line);
    if (document.activeElement !== box) {
      const lines = box.value.split("\n");
      const start = lines.slice(0, place.line - 1).reduce((sum, text) => sum + text.length + 1, 0);
      box.setSelectionRange(start, start + (lines[place.line - 1] ?? "").length);
    }
  }

  /** Shows what a command complains about. True if it says that an input is wrong. */
  function complain({ code, err }) {
    const found = / --> (.+):(\d+):(\d+)$/m.exec(err);
    const bad = code === 2 || code === 101;
    place = bad && found ? { name: found[1].replace(/^\.\//, ""), line: Number(found[2]) } : null;
    problem(bad ? err : "");
    if (place && files.has(place.name) && shown !== place.name && document.activeElement !== $("text")) {
      shown = place.name;
      tabs();
      edit();
    }
    mark();
    return bad;
  }

  let timer = 0;
  let checks = 0;
  /** Reads the files once more after a rest. */
  function check() {
    clearTimeout(timer);
    timer = setTimeout(async () => {
      const mine = ++checks;
      if (busy) return;
      if (!of("machine").length || !of("errors").length) {
        place = null;
        problem("");
        return;
      }
      const done = await run(["explain", last("machine"), last("errors")]);
      if (done && mine === checks && !busy && !complain(done)) sentences(done.out);
    }, REST);
  }

  $("text").addEventListener("input", () => {
    if ($("text").readOnly) return;
    const old = files.get(shown);
    files.set(shown, { ...old, bytes: encode($("text").value) });
    numbers();
    check();
  });
  $("text").addEventListener("scroll", () => ($("numbers").scrollTop = $("text").scrollTop));

  /* Commands. */

  let busy = false;

  /** Runs a command that the user has asked for; shows what it says: all of it, or the latest while it runs. */
  async function command(words, args, more, { isOnPort = false, showsLatest = false } = {}) {
    busy = true;
    changed();
    clearTimeout(timer);
    $("cancel").disabled = false;
    $("bar").removeAttribute("value");
    $("state").textContent = words;
    const begun = performance.now();
    const shows = (progress) => {
      const [, at, total, stage] = /^(\d+) (\d+) (.*)$/.exec(progress) ?? [];
      if (Number(total)) $("bar").value = at / total;
      else $("bar").removeAttribute("value");
      $("state").textContent = stage ?? "";
    };
    $("said").textContent = "";
    const print = (said) => {
      $("results").hidden = false;
      if (showsLatest) $("said").textContent = "";
      $("said").append(said);
    };
    const done = await run(args, more, shows, print, isOnPort);
    busy = false;
    $("cancel").disabled = true;
    $("bar").value = done ? 1 : 0;
    $("state").textContent = done
      ? `${["Done", "Done, but a check did not hold"][done.code] ?? "Not done"}, in ${((performance.now() - begun) / 1e3).toFixed(1)} s.`
      : "Cancelled.";
    changed();
    clearTimeout(timer);
    if (!done) return null;
    const bad = complain(done);
    if (!bad) {
      $("results").hidden = false;
      $("said").textContent = done.out + (done.err ? `\n${done.err}` : "");
    }
    return bad ? null : done;
  }

  /** The files that the last compensation has brought. */
  let made = {};

  function offer(added) {
    made = { ...made, ...added };
    controllable();
    $("downloads").replaceChildren(
      ...Object.entries(made).map(([name, bytes]) => {
        const button = element("button", { type: "button" }, `Download ${name}`);
        button.addEventListener("click", () => {
          const url = URL.createObjectURL(new Blob([bytes]));
          element("a", { href: url, download: name }).click();
          setTimeout(() => URL.revokeObjectURL(url), 1000);
        });
        return button;
      }),
    );
  }

  const [BLOB, PAGE, ERRORS] = ["machine.trax", "report.html", "errors.toml"];

  function options() {
    const given = [];
    for (const id of ["policy", "scheme", "tolerance", "target"])
      if ($(id).value !== "") given.push(`--${id}`, $(id).value);
    for (const id of ["best-effort", "allow-large"]) if ($(id).checked) given.push(`--${id}`);
    return given;
  }

  async function compile() {
    made = {};
    offer({});
    showReport(null);
    $("more").hidden = $("inside").hidden = true;
    const inputs = [last("machine"), last("errors")];
    const done = await command("Compiling", ["compile", ...inputs, "-o", BLOB, "--report", PAGE, ...options()]);
    if (!done) return;
    offer(done.files);
    if (!made[BLOB]) return;
    const inspected = await run(["inspect", BLOB], made);
    $("inspected").textContent = inspected?.out ?? "";
    $("more").hidden = $("inside").hidden = false;
    showReport(decode(made[PAGE]));
    const axes = pageWindow.trueaxis.machine.model.axes;
    $("cec-axes").value = axes.map(({ letter }, k) => `${letter}=AX${k + 1}`).join(",");
  }

  async function draw(quietly = false) {
    const args = ["report", last("machine"), last("errors"), "-o", PAGE];
    if (!quietly) offer((made = {}));
    const done = await command("Computing", args);
    if (!done) return;
    $("more").hidden = $("inside").hidden = true;
    offer(done.files);
    showReport(decode(done.files[PAGE]));
  }

  /** Runs a command that writes the error file. */
  async function toErrors(words, args, inputs) {
    made = {};
    offer({});
    const done = await command(words, [...args, "-o", ERRORS], Object.fromEntries(inputs));
    if (!done?.files[ERRORS]) return;
    offer(done.files);
    of("errors").forEach((old) => files.delete(old));
    // With the covariances that it refers to.
    for (const [name, bytes] of Object.entries(done.files)) if (name !== PAGE) put(name, bytes);
    shown = ERRORS;
    if (made[PAGE]) showReport(decode(made[PAGE]));
    changed();
  }

  const identify = () => {
    const artefact = last("artefact");
    const more = artefact ? ["--artefact", artefact] : [];
    const args = ["identify", last("machine"), last("probings"), ...more, "--report", PAGE];
    return toErrors("Identifying", args, []);
  };
  const measured = () => toErrors("Evaluating the runs", ["measured", last("machine"), ...of("runs").map(word)], []);

  /** Makes one more file from the tables. */
  async function convert(words, args) {
    const done = await command(words, args, { [BLOB]: made[BLOB] });
    if (done) offer(done.files);
  }

  const generate = (name) => convert("Writing code", ["generate", BLOB, "-o", name, "--compared", "100000"]);
  const cec = () =>
    convert("Writing tables", [
      "export",
      "cec",
      BLOB,
      ...["--axes", $("cec-axes").value, "--factor-tables", $("cec-factors").value],
      ...["--machine", last("machine"), "-o", "cec.mpf"],
    ]);
  const gcode = () => {
    const name = `corrected-${$("program").value}`;
    const setup = last("setup");
    return convert("Correcting the program", [
      ...["gcode", word($("program").value), "--compensation", BLOB, "--machine", last("machine")],
      ...(setup ? ["--setup", setup] : ["--units", "mm"]),
      ...["--dialect", $("dialect").value, "-o", name],
    ]);
  };

  /* A controller on a serial port. */

  /** The port, what writes to it and reads from it, and the end of the reading. */
  let [port, writer, reader, hearing] = [null, null, null, null];
  const canReachPorts = "serial" in navigator && typeof WebAssembly.Suspending === "function";

  function controllable() {
    $("connect").disabled = !canReachPorts || busy;
    $("connect").textContent = port ? "Disconnect" : "Connect";
    $("baud").disabled = Boolean(port);
    for (const button of document.querySelectorAll("#controller-actions button")) button.disabled = !port || busy;
    $("flash").disabled ||= !made[BLOB];
  }

  async function connect() {
    if (port) return disconnect();
    problem("");
    let chosen = null;
    try {
      chosen = await navigator.serial.requestPort();
      await chosen.open({ baudRate: Number($("baud").value) });
    } catch (error) {
      // The user has chosen none, or the port cannot be opened.
      if (chosen) problem(`error: the port cannot be opened: ${error.message}\nCheck that no other program has it open.`);
      return;
    }
    port = chosen;
    writer = port.writable.getWriter();
    hearing = hear(port);
    controllable();
  }

  /** Gives what arrives to the command, until the port is closed or lost. */
  async function hear(from) {
    const tell = async (arrived) => (await worker)?.postMessage({ arrived });
    // A damaged byte ends a stream; the next one goes on.
    while (from === port && from.readable) {
      reader = from.readable.getReader();
      try {
        for (let { value, done } = await reader.read(); !done; { value, done } = await reader.read()) await tell(value);
        if (from === port) break;
      } catch {
        // Where the port is lost, it is no longer readable.
      } finally {
        reader.releaseLock();
      }
    }
    await tell(null);
    if (from === port) await release(from);
  }

  async function disconnect() {
    const old = port;
    port = null;
    // A stream that has failed cannot be cancelled, and has ended.
    await reader.cancel().catch(() => {});
    await hearing;
    await release(old);
  }

  async function release(old) {
    port = null;
    try {
      writer.releaseLock();
      await old.close();
    } catch {
      // It is gone already.
    }
    controllable();
  }

  async function send(bytes) {
    try {
      await writer.write(bytes);
    } catch {
      (await worker)?.postMessage({ arrived: null });
    }
  }

  /** Runs a command on the port. */
  const onPort = (words, args, more = {}, showsLatest = false) =>
    command(words, [...args, "--port", "/serial"], more, { isOnPort: true, showsLatest });
  const flash = (...how) => onPort("Flashing", ["flash", BLOB, ...how], { [BLOB]: made[BLOB] });
  const control = (...what) => onPort("Asking the controller", ["control", ...what]);

  for (const [id, does] of Object.entries({
    compile,
    connect,
    flash: () => flash("--activate"),
    capacity: () => onPort("Asking the controller", ["flash", "--dry-run"]),
    show: () => control("show"),
    enable: () => control("enable"),
    disable: () => control("disable"),
    "dry-run": () => control("dry-run", "on"),
    "dry-run-off": () => control("dry-run", "off"),
    watch: () => onPort("Watching, until it is cancelled", ["monitor"], {}, true),
    draw: () => draw(),
    identify,
    measured,
    cancel: stop,
    rust: () => generate("corrections.rs"),
    c: () => generate("corrections.c"),
    cec,
    gcode,
    build,
    clear: () => {
      files.clear();
      $("example").value = "";
      place = null;
      problem("");
      changed();
    },
    "add-it": addParameter,
  }))
    $(id).addEventListener("click", does);

  /* The report, as a part of this page. */

  /** What the report's own script gets for its window: listeners end with the report. */
  let pageWindow = {};
  let ending = null;

  function showReport(html) {
    ending?.abort();
    $("errors").hidden = true;
    document.querySelector("main").insertBefore($("errors"), $("report"));
    $("report").replaceChildren();
    $("summary").replaceChildren();
    $("output").open = true;
    document.title = "trueaxis in the browser";
    if (html === null) return;
    const page = new DOMParser().parseFromString(html, "text/html");
    // Without scripts: only their data.
    const parts = [...page.querySelectorAll('main > *, script[type="application/json"]')];
    $("report").append(...parts.map((part) => document.importNode(part, true)));
    document.title = page.title;
    ending = new AbortController();
    const { signal } = ending;
    pageWindow = {
      addEventListener: (type, does) => window.addEventListener(type, does, { signal }),
    };
    drawReport(pageWindow);
    const verdict = document.querySelector("#report .verdict").textContent;
    $("summary").replaceChildren(element("b", {}, verdict), " ", element("a", { href: "#report" }, "The report"));
    $("output").open = false;
    $("axis-sliders").after($("errors"));
    switchable();
    parameters();
  }

  /** Lets the drawn machine move by what the tables add, as many times as large as its errors are drawn. */
  function switchable() {
    const { machine } = pageWindow.trueaxis;
    const frames = machine.frames.bind(machine);
    machine.frames = (state, wrong, added) => {
      if (wrong && !added && $("on").checked) {
        const times = Number((10 ** Number($("exaggeration-slider").value)).toPrecision(2));
        added = machine.correction(state).map((d) => d * times);
      }
      return frames(state, wrong, added);
    };
    $("on").checked = false;
    $("on").disabled = !machine.model.tables;
    $("on").onchange = () => pageWindow.trueaxis.redraw();
  }

  /* Errors, one by one. */

  const COMPONENTS = "XYZABC";
  const ENTRY = /^([ \t]*)(E[XYZABC][0-9XYZABCUVWS][0-9XYZABCUVWcsb]+)([ \t]*=[ \t]*)([-+0-9.eE_]+)/gm;

  /** The section of parameters in the text of an error file: from where to where. */
  function section(text) {
    const head = /^[ \t]*\[parameters\].*$/m.exec(text);
    if (!head) return [text.length, text.length];
    const start = head.index + head[0].length;
    const end = text.slice(start).search(/^[ \t]*\[/m);
    return [start, end < 0 ? text.length : start + end];
  }

  /** The parameters of the error file: names and values. */
  function entries() {
    const name = of("errors").pop();
    if (!name) return [];
    const text = decode(files.get(name).bytes);
    const all = text.slice(...section(text)).matchAll(ENTRY);
    return [...all].map((m) => [m[2], Number(m[4].replaceAll("_", ""))]);
  }

  /** Puts an error into the model of the drawing. False if it has no place there. */
  function setInModel(model, name, value) {
    const component = COMPONENTS.indexOf(name[1]);
    const index = (letter) => model.axes.findIndex((axis) => axis.letter === letter);
    if (name[2] === "0") {
      const axis = name[3] === "S" ? model.axes.length : index(name[3]);
      if (axis < 0) return false;
      model.locations[axis][component] = value;
      return true;
    }
    const axis = model.axes[index(name[2])];
    if (!axis) return false;
    axis.motions[component] ??= {
      coefficients: [],
      harmonics: [],
      backlash: 0,
      tabulated: null,
      per_kelvin: [],
      holds: false,
    };
    const motion = axis.motions[component];
    const [, kind, degree] = /^([csb]?)(\d*)$/.exec(name.slice(3)) ?? [];
    if (kind === "b") motion.backlash = value;
    else if (kind) {
      const k = Number(degree);
      while (motion.harmonics.length < k) motion.harmonics.push([0, 0]);
      motion.harmonics[k - 1][kind === "c" ? 0 : 1] = value;
    } else if (degree) {
      const k = Number(degree);
      while (motion.coefficients.length <= k) motion.coefficients.push(0);
      motion.coefficients[k] = value;
      motion.holds ||= k >= 2;
    } else return false;
    return true;
  }

  /** A slider for each parameter. */
  function parameters() {
    const { machine, drawing, redraw } = pageWindow.trueaxis;
    const sliders = new Sliders(drawing, null, redraw);
    const all = entries().map(([name, first]) => {
      let value = first;
      const most = 3 * Math.abs(first) || 1e-4;
      return sliders.make(
        {
          id: `error-${name}`,
          name,
          words: "",
          range: [-most, most],
          read: () => value,
          write: (now) => {
            value = Number(now.toPrecision(3));
            setInModel(machine.model, name, value);
            write(name, value);
          },
          say: (now) => `${Number((1e6 * now).toPrecision(3))}e-6`.replace(/^-/, "−"),
        },
        element("small", { id: `error-${name}-note` }),
      );
    });
    $("parameters").replaceChildren(...all);
    const motions = (axis) => [
      ...[...COMPONENTS].map((c) => `E${c}0${axis.letter}`),
      ...[...COMPONENTS].map((c) => `E${c}${axis.letter}1`),
      ...[...COMPONENTS].map((c) => `E${c}${axis.letter}2`),
      `E${COMPONENTS[axis.component + (axis.rotary ? 3 : 0)]}${axis.letter}b`,
    ];
    const known = new Set(entries().map(([name]) => name));
    const names = [...machine.model.axes.flatMap(motions), ...["X", "Y", "Z"].map((c) => `E${c}0S`)];
    $("add").replaceChildren(...names.filter((name) => !known.has(name)).map((name) => element("option", {}, name)));
    $("errors").hidden = false;
    check();
  }

  /** Changes a value in the error file. */
  function write(name, value) {
    const file = of("errors").pop();
    const text = decode(files.get(file).bytes);
    const [start, end] = section(text);
    const changed = text
      .slice(start, end)
      .replace(ENTRY, (all, space, found, equals) =>
        found === name ? `${space}${found}${equals}${value.toExponential()}` : all,
      );
    const now = text.slice(0, start) + changed + text.slice(end);
    files.set(file, { role: "errors", bytes: encode(now) });
    if (shown === file) edit();
    check();
  }

  async function addParameter() {
    const file = of("errors").pop();
    const text = decode(files.get(file).bytes);
    const name = $("add").value;
    if (!name || entries().some(([found]) => found === name)) return;
    const [start] = section(text);
    const head = /^[ \t]*\[parameters\]/m.test(text) ? "" : "\n[parameters]";
    const now = `${text.slice(0, start)}${head}\n${name} = 50e-6${text.slice(start)}\n`;
    put(file, encode(now));
    setInModel(pageWindow.trueaxis.machine.model, name, 50e-6);
    pageWindow.trueaxis.redraw();
    if (shown === file) edit();
    parameters();
    $(`error-${name}`)?.focus();
  }

  /** What `explain` says beside each slider. */
  function sentences(text) {
    for (const line of text.split("\n")) {
      const [, name, words] = /^(\w+)(?: = [^,:]+)?[,:] (.*)$/.exec(line) ?? [];
      const note = name && $(`error-${name}-note`);
      if (note) note.textContent = words;
    }
  }

  /* The machine builder. */

  const KINDS = {
    "three axes, router": "wFYXZSt",
    "three axes, moving table": "wXYFZSt",
    "trunnion, A and C in the table": "wCAYFXZSt",
    "trunnion on a column": "wCBFXYZSt",
    "table and head": "wCYFXZBSt",
    "fork head": "wFXYZCASt",
    "gantry with fork head": "wFXYZCBSt",
  };

  /** The axes of a layout, from the workpiece to the tool; `null` if it is none. */
  function read(layout) {
    const found = /^w([XYZUVWABC]*)[Ff]([XYZUVWABC]*)S?t$/.exec(layout.trim());
    if (!found) return null;
    const [, workpiece, tool] = found;
    const all = [
      ...[...workpiece].map((letter) => ({ letter, branch: "workpiece" })),
      ...[...tool].map((letter) => ({ letter, branch: "tool" })),
    ];
    return new Set(all.map(({ letter }) => letter)).size === all.length ? all : null;
  }

  function axisRows() {
    const axes = read($("layout").value);
    $("layout").setAttribute("aria-invalid", String(!axes));
    $("layout-note").classList.toggle("alarm", !axes);
    $("build").disabled = !axes;
    if (!axes) return;
    const rows = axes.map(({ letter, branch }) => {
      const rotary = "ABC".includes(letter);
      const cell = (what, value, label) =>
        element(
          "td",
          {},
          element("input", { type: "number", step: "any", value, "data-key": what, "aria-label": `${letter}: ${label}` }),
        );
      const range = rotary ? [-120, 120] : [-250, 250];
      const reversed = element("input", { type: "checkbox", "data-key": "reversed", "aria-label": `${letter}: reversed` });
      return element(
        "tr",
        { "data-letter": letter, "data-branch": branch },
        element("th", { scope: "row" }, `${letter} carries the ${branch}`),
        cell("from", range[0], "from"),
        cell("to", range[1], "to"),
        ...["x", "y", "z"].map((c) => cell(c, 0, `origin ${c}`)),
        element("td", {}, reversed),
      );
    });
    $("axes").tBodies[0].replaceChildren(...rows);
  }

  async function build() {
    const name = JSON.stringify($("name").value || "My machine");
    // The file lists each branch from the foundation outwards.
    const rows = [...$("axes").tBodies[0].rows];
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
    const machine =
      `name = ${name}\ntopology = "${$("layout").value.trim()}"\n\n${axes.join("\n")}\n` +
      `[spindle]\naxis = "z"\n\n[tool]\ntip_mm = [0, 0, ${-Number($("tool").value)}]\n`;
    const linear = rows.map((row) => row.dataset.letter).filter((letter) => "XYZ".includes(letter));
    const scales = linear.map((letter) => `E${letter}${letter}1 = 50e-6\n`).join("");
    files.clear();
    put("machine.toml", encode(machine));
    put(ERRORS, encode(`machine = ${name}\n\n[parameters]\n${scales}`));
    shown = "machine.toml";
    $("example").value = "";
    changed();
    await draw();
    if (made[PAGE]) offer({ "machine.toml": encode(machine) });
  }

  $("kind").replaceChildren(...Object.entries(KINDS).map(([words, layout]) => element("option", { value: layout }, words)));
  $("kind").addEventListener("change", () => {
    $("layout").value = $("kind").value;
    axisRows();
  });
  $("layout").addEventListener("input", axisRows);
  $("kind").value = KINDS["trunnion, A and C in the table"];
  $("layout").value = $("kind").value;
  axisRows();

  /* Opening. */

  const examples = JSON.parse($("examples").textContent);
  $("example").replaceChildren(
    element("option", { value: "" }, "choose one"),
    ...Object.keys(examples).map((name) => element("option", {}, name)),
  );
  $("example").addEventListener("change", () => $("example").value && example($("example").value));
  $("open").addEventListener("change", async () => {
    await take($("open").files);
    $("open").value = "";
  });
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  window.addEventListener("dragleave", (event) => event.relatedTarget ?? document.body.classList.remove("dropping"));
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("dropping");
    take(event.dataTransfer.files);
  });
  if (!canReachPorts)
    $("ports-note").textContent =
      "This browser cannot reach serial ports; Chrome and Edge can. Or download the tables and use the command: trueaxis flash.";
  worker = start();
  changed();

  /** For tests: what was dropped and what was made. */
  window.trueaxisPage = { take, files, made: () => made };
})();
