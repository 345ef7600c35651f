/* The page: files in, commands in a worker, what they say and write out. Texts of files become text, never markup. */
(() => {
  "use strict";
  const { element } = Sliders;
  const { encode, decode, roleOf, unreadable, pack, unpack } = Files;
  const $ = (id) => document.getElementById(id);

  /** Largest file, and all files together, in bytes. */
  const MOST = 20e6;
  /** Largest text that can be edited here. */
  const MOST_EDITED = 500e3;
  /** Milliseconds after which a change is looked at. */
  const REST = 500;

  const [BLOB, PAGE, ERRORS] = ["machine.trax", "report.html", "errors.toml"];
  const TITLE = document.title;
  /** What is chosen when the page opens. */
  const FIRST = "first";
  /** Milliseconds after which a slider that was moved is looked at. */
  const SOON = 60;

  /* Workers. */

  /** What the user has asked for, and what keeps the first view up to date. */
  const all = () => Object.fromEntries([...files].map(([name, { bytes }]) => [name, bytes]));
  const [asked, live] = [new Runner(all, send), new Runner(all, send)];

  /* Files. */

  /** Names to `{ bytes, role }`. */
  const files = new Map();
  let shown = null;

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
        true,
      );
      return;
    }
    cause = $("open").closest(".row");
    const refused = [];
    keepNow();
    for (const file of all) {
      const bytes = new Uint8Array(await file.arrayBuffer());
      const wrong = unreadable(file.name, bytes);
      if (wrong) {
        refused.push(wrong);
        continue;
      }
      if (/\.json$/i.test(file.name) && restoreFrom(decode(bytes))) continue;
      const role = roleOf(file.name, bytes);
      // One machine, one set of errors.
      if (["machine", "errors", "artefact", "setup"].includes(role)) of(role).forEach((old) => files.delete(old));
      put(file.name, bytes);
      shown = file.name;
    }
    chosen = null;
    changed();
    problem(refused.join("\n\n"), true);
  }

  function example(name) {
    keepNow();
    cause = $("cards");
    problem("");
    files.clear();
    for (const [file, text] of Object.entries(examples[name].files)) put(file, encode(text));
    const given = examples[name].options.split(" ");
    for (const id of ["policy", "scheme", "tolerance"])
      $(id).value = given.includes(`--${id}`) ? given[given.indexOf(`--${id}`) + 1] : "";
    for (const id of ["best-effort", "allow-large"]) $(id).checked = given.includes(`--${id}`);
    chosen = name;
    shown = last("machine");
    changed();
  }

  /** What a button needs, and what is said beside it until that is there. */
  const NEEDS = {
    compile: { roles: ["machine", "errors"], why: "compile-why" },
    draw: { roles: ["machine", "errors"], why: "compile-why" },
    identify: { roles: ["machine", "probings"], why: "identify-why" },
    measured: { roles: ["machine", "runs"], why: "measured-why" },
    gcode: { roles: ["program"], why: "gcode-why" },
    "keep-trax": { roles: ["machine", "errors"], why: "keep-note" },
    "keep-report": { roles: ["machine", "errors"], why: "keep-note" },
  };
  const ROLES = {
    machine: "a machine (machine.toml)",
    errors: "its errors (errors.toml)",
    probings: "probings of balls (CSV with a column ball)",
    runs: "runs of a laser (CSV with the lines # axis and # reads)",
    program: "a program in G-code",
  };

  /** Shows the files, and what can be done with them. */
  function changed() {
    if (!files.has(shown)) shown = [...files.keys()][0] ?? null;
    tabs();
    edit();
    for (const id of new Set(Object.values(NEEDS).map(({ why }) => why))) $(id).textContent = "";
    for (const [id, { roles, why }] of Object.entries(NEEDS)) {
      const missing = roles.filter((role) => !of(role).length);
      $(id).disabled = missing.length > 0 || busy;
      if (missing.length) $(why).textContent = `Needs ${missing.map((role) => ROLES[role]).join(" and ")}.`;
    }
    controllable();
    $("program").replaceChildren(...of("program").map((name) => element("option", {}, name)));
    keepFiles();
    cards();
    check();
    keep();
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

  /** What was changed or pressed last: a problem is shown beside it; `null` for the text of a file. */
  let cause = null;

  let problemStays = false;
  /** The place of a problem while there is none. */
  const atHome = () => $("texts").after($("problem"));

  /** Shows a problem, or that there is none. One that is not of the files as they are `stays` until something else is done. */
  function problem(text, stays = false) {
    const box = $("problem");
    problemStays = stays;
    box.replaceChildren(...(text ? [element("pre", {}, text.trim())] : []));
    if (!text) return atHome();
    if (cause) cause.after(box);
    else {
      $("texts").open = true;
      $("editor").after(box);
    }
    if (document.activeElement !== $("text")) box.scrollIntoView({ block: "nearest" });
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
    if (bad || !problemStays) problem(bad ? err : "");
    if (place && files.has(place.name) && shown !== place.name && document.activeElement !== $("text")) {
      shown = place.name;
      tabs();
      edit();
    }
    mark();
    return bad;
  }

  /* The first view, kept up to date. */

  const stage = new Stage($("stage-machine"), $("stage-circle"));
  /** The answer of the command to the files as they are: the model, what is said of its errors, and what may be added. */
  let known = null;
  /** The words of a compensation that could not be made. */
  let refusal = "";
  let timer = 0;
  let checks = 0;
  /** Counts changes; the tables belong to the errors of the second. */
  let [changes, compiled] = [0, -1];
  /** Milliseconds that an older computation may go on after a change. */
  const PATIENCE = 400;
  let begun = 0;

  /** True if a slider has put into the drawing all that has changed. */
  let isDrawn = false;

  /** Reads the files once more after a rest. */
  function check(rest = REST, drawn = false) {
    clearTimeout(timer);
    isDrawn = drawn && known !== null && (problemStays || !$("problem").firstChild);
    changes++;
    timer = setTimeout(follow, rest);
  }

  async function follow() {
    if (busy) return;
    if (live.waiting.size && performance.now() - begun < PATIENCE) {
      timer = setTimeout(follow, SOON);
      return;
    }
    // What an older change has asked for is of no use any more.
    if (live.waiting.size) live.stop();
    begun = performance.now();
    const [mine, these, drawn] = [++checks, changes, isDrawn];
    if (!of("machine").length || !of("errors").length) {
      place = null;
      if (!problemStays) problem("");
      tell();
      return;
    }
    const inputs = [last("machine"), last("errors")];
    const isOld = () => mine !== checks || busy;
    if (!drawn) {
      const found = await live.run(["model", ...inputs]);
      if (!found || isOld() || complain(found)) return tell();
      accept(JSON.parse(found.out), stage.machine?.model.tables);
    }
    const made = await live.run(["compile", ...inputs, "-o", BLOB, ...options()]);
    if (!made || isOld()) return;
    if (drawn && !made.files[BLOB]) return check(0);
    complain({ code: 0, err: "" });
    refusal = made.files[BLOB] ? "" : made.err;
    if (refusal) {
      stage.machine.model.tables = null;
      stage.acts = stage.wanted = 0;
      compiled = these;
      stage.changed();
      return tell();
    }
    const whole = await live.run(["model", ...inputs, BLOB], made.files);
    if (!whole || isOld() || whole.code) return;
    compiled = these;
    accept(JSON.parse(whole.out));
  }

  /** Shows what the command knows of the files. Older tables act until there are new ones, if the axes are the same. */
  function accept(answer, older = null) {
    const { model } = answer;
    if (!model.tables && older && stage.shape === Stage.shapeOf(model)) model.tables = older;
    known = answer;
    // What was changed since.
    for (const [name, value] of entries()) Errors.set(model, name, value);
    stage.show(model);
    if (isOn && model.tables && !stage.wanted) stage.act(true);
    rows();
    tell();
  }

  $("text").addEventListener("input", () => {
    if ($("text").readOnly) return;
    const old = files.get(shown);
    files.set(shown, { ...old, bytes: encode($("text").value) });
    cause = chosen = null;
    cards();
    numbers();
    check();
    keep();
  });
  $("text").addEventListener("scroll", () => ($("numbers").scrollTop = $("text").scrollTop));

  /* Commands. */

  let busy = false;

  /** Runs a command that the user has asked for; shows what it says: all of it, or the latest while it runs. */
  async function command(words, args, more, { isOnPort = false, showsLatest = false } = {}) {
    busy = true;
    live.stop();
    changed();
    clearTimeout(timer);
    problem("");
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
    const done = await asked.run(args, more, shows, print, isOnPort);
    busy = false;
    $("cancel").disabled = true;
    $("bar").value = done ? 1 : 0;
    $("state").textContent = done
      ? `${["Done", "Done, but a check did not hold"][done.code] ?? "Not done"}, in ${((performance.now() - begun) / 1e3).toFixed(1)} s.`
      : "Cancelled.";
    changed();
    if (!done) return null;
    const bad = complain(done);
    if (!bad) {
      $("results").hidden = false;
      $("said").textContent = done.out + (done.err ? `\n${done.err}` : "");
      $("progress").scrollIntoView({ block: "nearest" });
    } else clearTimeout(timer);
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
        button.addEventListener("click", () => download(name, bytes));
        return button;
      }),
    );
  }

  function download(name, content) {
    const url = URL.createObjectURL(new Blob([content]));
    element("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
    $("keep-note").textContent = `${name} is downloaded.`;
  }

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
    const inspected = await asked.run(["inspect", BLOB], made);
    $("inspected").textContent = inspected?.out ?? "";
    $("more").hidden = $("inside").hidden = false;
    showReport(decode(made[PAGE]));
    const axes = pageWindow.trueaxis.machine.model.axes;
    $("cec-axes").value = axes.map(({ letter }, k) => `${letter}=AX${k + 1}`).join(",");
  }

  async function draw() {
    const args = ["report", last("machine"), last("errors"), "-o", PAGE];
    offer((made = {}));
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
    $("controller-why").textContent = !port
      ? "Connect a controller first."
      : made[BLOB]
        ? ""
        : "To flash, make the tables first.";
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
      if (chosen) problem(`error: the port cannot be opened: ${error.message}\nCheck that no other program has it open.`, true);
      return;
    }
    port = chosen;
    writer = port.writable.getWriter();
    hearing = hear(port);
    controllable();
  }

  /** Gives what arrives to the command, until the port is closed or lost. */
  async function hear(from) {
    const tell = async (arrived) => asked.worker?.postMessage({ arrived });
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
      asked.worker?.postMessage({ arrived: null });
    }
  }

  /** Runs a command on the port. */
  const onPort = (words, args, more = {}, showsLatest = false) =>
    command(words, [args[0], "--port", "/serial", ...args.slice(1)], more, { isOnPort: true, showsLatest });
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
    draw,
    identify,
    measured,
    cancel: () => asked.stop(),
    rust: () => generate("corrections.rs"),
    c: () => generate("corrections.c"),
    cec,
    gcode,
    build,
    clear: () => {
      keepNow();
      files.clear();
      chosen = place = null;
      problem("");
      changed();
    },
    "add-it": add,
    zero,
    link: copyLink,
    "keep-trax": () => keepMade(BLOB),
    "keep-report": () => keepMade(PAGE),
    "keep-svg": () => download("machine.svg", svg()),
    "keep-png": png,
  }))
    $(id).addEventListener("click", (event) => {
      if ($("actions").contains(event.target) || $("controller").contains(event.target)) cause = event.target.closest(".row");
      return does();
    });

  /* The report, as a part of this page. */

  /** What the report's own script gets for its window: listeners end with the report. */
  let pageWindow = {};
  let ending = null;

  function showReport(html) {
    ending?.abort();
    $("report").replaceChildren();
    $("summary").replaceChildren();
    $("output").open = true;
    document.title = TITLE;
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
    $("summary").scrollIntoView({ block: "center" });
  }

  /* What is said of the machine. */

  let announcing = 0;
  /** Reads a sentence to those who do not see it, after a rest. */
  function announce(text) {
    clearTimeout(announcing);
    announcing = setTimeout(() => {
      if ($("announced").textContent !== text) $("announced").textContent = text;
    }, 2 * REST);
  }

  let [inArcsec, isOn] = [false, false];
  let words = null;

  /** The sentence, the switch, and why it cannot be used. */
  function tell() {
    const all = entries().filter(([, value]) => value !== 0);
    // With tabulated and thermal ones, which have no slider.
    const others = (known?.explained ?? []).filter(([name]) => !entries().some(([found]) => found === name));
    const count = all.length + others.length;
    const isOnly = count === 1 && all[0]?.[0] === first?.name;
    words = stage.machine
      ? stage.words(isOnly ? `${first.leans} by ${amount(first.name, Math.abs(all[0][1]))}` : null, count, compiled !== changes)
      : { strong: "", rest: "", facts: "" };
    $("sentence").replaceChildren(element("b", { class: stage.wanted ? "after" : "before" }, words.strong), words.rest);
    $("facts").textContent = words.facts;
    for (const id of ["stage-machine", "stage-circle"])
      $(id).setAttribute(
        "aria-label",
        id === "stage-machine"
          ? "The machine, moving round a circle, its errors drawn larger than they are. Arrow keys turn it."
          : `The circle that the machine cuts: ${words.strong}`,
      );
    announce(words.strong + words.rest);
    const can = Boolean(stage.machine?.model.tables);
    $("tables-switch").disabled = !can;
    $("tables-switch").setAttribute("aria-checked", String(stage.wanted === 1));
    $("tables-word").textContent = stage.wanted ? "on" : "off";
    const isBroken = !problemStays && Boolean($("problem").firstChild);
    $("tables-note").textContent = isBroken
      ? "The files have an error; what is drawn is the machine before it."
      : can
        ? ""
        : refusal
          ? `No tables: ${refusal.trim().split("\n")[0].replace(/^(error|warning): /, "")}.`
          : of("machine").length && of("errors").length
            ? "The tables are being computed."
            : "Tables need a machine and its errors.";
  }

  /** A value of the file with its unit. */
  function amount(name, value) {
    const { factor, unit, where = "" } = Errors.unit(stage.machine.model, name, inArcsec);
    return `${minus(shortest(value * factor))} ${unit}${where}`;
  }

  const shortest = (value) => String(Number(value.toPrecision(3)));
  const minus = (text) => text.replace("-", "−");

  /* Errors, one by one. */

  /** The parameters of the error file: names and values. */
  function entries() {
    const name = of("errors").pop();
    return name ? Errors.read(decode(files.get(name).bytes)) : [];
  }

  /** Changes the text of the error file, or begins one. */
  function rewrite(change) {
    const name = of("errors").pop() ?? ERRORS;
    const text = files.has(name) ? decode(files.get(name).bytes) : "[parameters]\n";
    const isNew = !files.has(name);
    chosen = null;
    cards();
    files.set(name, { role: "errors", bytes: encode(change(text)) });
    if (isNew) changed();
    else if (shown === name) edit();
  }

  /** Changes a value in the drawing at once, in the file, and soon in the tables. */
  function set(name, value, held) {
    rewrite((text) => Errors.write(text, name, value));
    Errors.set(stage.machine.model, name, value);
    stage.changed(held);
    tell();
    check(SOON, compiled === changes || isDrawn);
    keep();
  }

  /** The first slider, and what it is in words. */
  let first = null;
  /** Shows of all sliders, by name: to be called where another one has changed their value. */
  let shows = new Map();

  /** A slider with a field for its number, both in the unit of a person. */
  function slider(id, name, label, others = []) {
    const { model } = stage.machine;
    const value = () => Number(Object.fromEntries(entries())[name] ?? 0);
    const { factor, unit, where = "" } = Errors.unit(model, name, inArcsec);
    let most = Errors.most(model, name, stage.drawing.size, value(), inArcsec);
    const range = element("input", { type: "range", id, "aria-describedby": `${id}-note` });
    const field = element("input", {
      inputmode: "decimal",
      autocomplete: "off",
      size: "7",
      id: `${id}-number`,
      "aria-label": `${label.textContent}, in ${unit}${where}`,
      "aria-describedby": `${id}-note`,
    });
    const limit = () => {
      for (const [key, at] of Object.entries({ min: -most, max: most, step: most / 250 })) range.setAttribute(key, at);
    };
    const show = (source) => {
      const now = value() * factor;
      if (Math.abs(now) > most) {
        most = Errors.most(model, name, stage.drawing.size, value(), inArcsec);
        limit();
      }
      if (source !== range) range.value = now;
      if (source !== field) field.value = minus(shortest(now));
      range.setAttribute("aria-valuetext", `${minus(shortest(now))} ${unit}${where}`);
    };
    const put = (shownValue, source, held) => {
      cause = source.closest(".error, #first-slider");
      set(name, Number((shownValue / factor).toPrecision(4)), held);
      for (const update of shows.get(name) ?? []) update(source);
    };
    range.addEventListener("input", () => put(Number(range.value), range, true));
    range.addEventListener("change", () => stage.changed());
    field.addEventListener("input", () => {
      // A decimal comma is understood.
      const text = field.value.trim().replace("−", "-").replace(",", ".");
      const isNumber = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(text);
      field.setAttribute("aria-invalid", String(!isNumber));
      note.classList.toggle("alarm", !isNumber);
      if (!isNumber) note.textContent = `“${field.value}” is not a number: write 12.5 or −0.3.`;
      else put(Number(text), field, false);
    });
    field.addEventListener("blur", () => field.getAttribute("aria-invalid") !== "true" && show());
    const note = element("small", { id: `${id}-note` });
    label.setAttribute("for", id);
    limit();
    show();
    shows.set(name, [...(shows.get(name) ?? []), show]);
    const number = element("span", { class: "number" }, field, ` ${unit}${where}`);
    return element("div", { class: "error" }, label, number, range, ...others, note);
  }

  const capital = (text) => text[0].toUpperCase() + text.slice(1);

  /** What the first slider and the others were made for. */
  let [firstOf, rowsOf] = ["", ""];
  /** The first slider and one for each error; made anew where there are others. */
  function rows() {
    const { model } = stage.machine;
    const words = Object.fromEntries(known.known);
    const names = entries().map(([name]) => name).filter((name) => Errors.parts(model, name));
    const [x, y] = stage.pair;
    const name = Errors.squareness(model, [x, y], names);
    const of = JSON.stringify([stage.shape, inArcsec, name]);
    if (of !== firstOf) {
      firstOf = of;
      rowsOf = "";
      shows = new Map();
      const [leaning, other] = name.endsWith(x.letter) ? [x, y] : [y, x];
      first = { name, leans: `${leaning.letter} is out of square with ${other.letter}` };
      const label = element("label", {}, element("b", {}, `How far ${leaning.letter} is out of square with ${other.letter}`));
      $("first-slider").replaceChildren(slider("squareness", name, label));
      const { factor } = Errors.unit(model, name, inArcsec);
      stage.expected = (stage.radius * Errors.most(model, name, stage.drawing.size, 0, inArcsec)) / factor;
      stage.changed();
    }
    if (JSON.stringify(names) !== rowsOf) {
      rowsOf = JSON.stringify(names);
      // Only the first slider stays.
      shows = new Map([[name, shows.get(name).slice(0, 1)]]);
      atHome();
      $("parameters").replaceChildren(
        ...names.map((name) => {
          const remove = element("button", { type: "button", class: "remove", "aria-label": `Remove ${name}`, title: "Remove" }, "×");
          remove.addEventListener("click", () => {
            rewrite((text) => Errors.remove(text, name));
            check(0);
            keep();
            $("add").focus();
          });
          const label = element("label", {}, element("b", {}, capital(words[name] ?? name)), " ", element("code", {}, name));
          return slider(`error-${name}`, name, label, [remove]);
        }),
      );
      if (!names.length) $("parameters").replaceChildren(element("p", { class: "note" }, "No error is set: this machine is perfect."));
      addable(words, names);
    }
    for (const all of shows.values()) for (const show of all) show(document.activeElement);
    $("squareness-note").textContent = "";
    for (const [name, sentence] of known.explained) {
      const note = $(`error-${name}-note`);
      if (note) note.classList.remove("alarm");
      const said = /^\w+(?: = [^,:]+)?[,:] (.*)$/.exec(sentence)?.[1];
      if (note && said) note.textContent = capital(said);
    }
  }

  /** Errors that can be added, axis by axis. */
  function addable(words, names) {
    const groups = new Map([["Where the axes stand", []]]);
    for (const [name, said] of Object.entries(words)) {
      if (names.includes(name)) continue;
      const group = name[2] === "0" ? "Where the axes stand" : `As ${name[2]} moves`;
      groups.set(group, [...(groups.get(group) ?? []), element("option", { value: name }, `${capital(said)} (${name})`)]);
    }
    $("add").replaceChildren(
      ...[...groups].map(([label, all]) => {
        const group = element("optgroup", { label });
        group.append(...all);
        return group;
      }),
    );
    const wanted = stage.machine.model.axes.find((a) => !a.rotary)?.letter;
    $("add").value = Object.keys(words).find((name) => name === `E${wanted}${wanted}1` && !names.includes(name)) ?? $("add").value;
  }

  function add() {
    const name = $("add").value;
    if (!name || entries().some(([found]) => found === name)) return;
    cause = $("parameters");
    rewrite((text) => Errors.write(text, name, 0));
    Errors.set(stage.machine.model, name, 0);
    rows();
    check(0);
    keep();
    $(`error-${name}`)?.focus();
  }

  function zero() {
    cause = $("parameters");
    keepNow();
    rewrite((text) => Errors.rewrite(text, () => 0));
    check(0);
    keep();
  }

  /* Nothing is lost: the files are in the address. */

  /** Longest address that browsers take. */
  const MOST_ADDRESS = 800e3;
  /** Largest files that are tried to be written into it, in bytes. */
  const MOST_KEPT = 4e6;
  const OPTIONS = ["policy", "scheme", "tolerance", "target", "best-effort", "allow-large"];
  let keeping = 0;

  /** Everything that has been entered, as text. */
  function state() {
    const set = (id) => ($(id).type === "checkbox" ? $(id).checked : $(id).value);
    const coded = ({ bytes }) => btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join(""));
    const isText = (bytes) => encode(decode(bytes)).length === bytes.length && !bytes.includes(0);
    return JSON.stringify({
      trueaxis: 1,
      files: Object.fromEntries(
        [...files].map(([name, file]) => [name, isText(file.bytes) ? decode(file.bytes) : { base64: coded(file) }]),
      ),
      options: Object.fromEntries(OPTIONS.map((id) => [id, set(id)]).filter(([, value]) => value && value !== "stm32f405")),
      chosen,
      isOn,
      inArcsec,
    });
  }

  /** The address that holds what is here; to be known when it comes back. */
  let written = null;
  let isTooLarge = false;

  /** Writes it into the address after a rest. */
  function keep() {
    clearTimeout(keeping);
    keeping = setTimeout(keepAtOnce, REST);
  }

  async function keepAtOnce() {
    clearTimeout(keeping);
    const size = [...files.values()].reduce((sum, { bytes }) => sum + bytes.length, 0);
    const address = size > MOST_KEPT ? null : await pack(state());
    isTooLarge = !address || address.length > MOST_ADDRESS;
    if (isTooLarge) $("keep-note").textContent = "These files are too large for a link: download everything, and open it here again.";
    else if (address !== location.hash) history.replaceState(null, "", (written = address));
  }

  /** Before another machine takes its place: Back returns to what is here. */
  function keepNow() {
    if (!written) return;
    history.pushState(null, "", location.hash);
    keep();
  }

  /** Takes back a state. False if it is none. */
  function restoreFrom(text) {
    let old = null;
    try {
      old = JSON.parse(text);
    } catch {
      return false;
    }
    if (old?.trueaxis !== 1 || typeof old.files !== "object") return false;
    files.clear();
    for (const [name, content] of Object.entries(old.files)) {
      const bytes = typeof content === "string" ? encode(content) : Uint8Array.from(atob(content.base64), (c) => c.charCodeAt(0));
      put(name, bytes);
    }
    for (const id of OPTIONS) {
      if ($(id).type === "checkbox") $(id).checked = Boolean(old.options[id]);
      else $(id).value = old.options[id] ?? (id === "target" ? "stm32f405" : "");
    }
    chosen = old.chosen ?? null;
    isOn = Boolean(old.isOn);
    arcsec(Boolean(old.inArcsec));
    shown = last("machine");
    return true;
  }

  /** What the address holds; false if it holds nothing. */
  async function restore() {
    if (!location.hash.startsWith("#1.")) return false;
    try {
      const whole = await unpack(location.hash);
      written = location.hash;
      return restoreFrom(whole);
    } catch {
      $("damaged").hidden = false;
      return false;
    }
  }

  window.addEventListener("popstate", async () => {
    if (location.hash === written || !(await restore())) return;
    changed();
  });
  window.addEventListener("beforeunload", (event) => isTooLarge && event.preventDefault());

  /** Everything that can be downloaded as it is. */
  function keepFiles() {
    const all = [...files].map(([name, { bytes }]) => [name, () => download(name, bytes)]);
    if (files.size) all.push(["Everything (trueaxis.json)", () => download("trueaxis.json", state())]);
    $("keep-files").replaceChildren(
      ...all.map(([name, does]) => {
        const button = element("button", { type: "button" }, name);
        button.addEventListener("click", does);
        return button;
      }),
    );
  }

  async function copyLink() {
    await keepAtOnce();
    if (isTooLarge) return;
    try {
      await navigator.clipboard.writeText(location.href);
      $("keep-note").textContent = "The link is copied. It holds the files themselves.";
    } catch {
      $("keep-note").textContent = "This browser does not let the page copy: take the link from the address bar.";
    }
  }

  /** Makes a file that is not there yet, and downloads it. */
  async function keepMade(name) {
    cause = $("keep-files");
    const inputs = [last("machine"), last("errors")];
    const more = name === PAGE ? ["--report", PAGE] : [];
    const computed = command("Compiling", ["compile", ...inputs, "-o", BLOB, ...more, ...options()]);
    $("keep-note").textContent = "Computing…";
    const done = await computed;
    if (done?.files[name]) return download(name, done.files[name]);
    if (done && name === PAGE) {
      const plain = await command("Computing", ["report", ...inputs, "-o", PAGE]);
      if (plain?.files[PAGE]) return download(PAGE, plain.files[PAGE]);
    }
    $("keep-note").textContent = done ? `There is no ${name}: ${done.err.trim().split("\n")[0]}` : "Nothing is downloaded.";
  }

  const svg = () => stage.picture(words);

  /** The picture as PNG, twice as fine as on the screen. */
  async function png() {
    const image = new Image();
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg())}`;
    await image.decode();
    const canvas = element("canvas", { width: 2 * image.width, height: 2 * image.height });
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    download("machine.png", await new Promise((done) => canvas.toBlob(done)));
  }

  /* Machines. */

  /** What is offered first: an example with its errors, or a layout without. */
  const CARDS = [
    ["Router", "Three axes, a moving portal", { example: "router-10" }],
    ["Mill", "Three axes, a moving table", { example: "mill-21" }],
    ["Trunnion table", "Five axes, A and C carry the workpiece", { example: "xyzac-11" }],
    ["Table and head", "Five axes, C turns the table, B the head", { example: "table-head-13" }],
    ["Fork head", "Five axes, both turn the tool", { layout: "wFXYZCASt" }],
    ["Gantry", "Five axes, three metres long", { example: "fork-head-13" }],
  ];
  /** The example or layout that was chosen, until files are opened. */
  let chosen = null;

  function cards() {
    if (!$("cards").children.length)
      $("cards").append(
        ...CARDS.map(([name, words, { example: of, layout }]) => {
          const button = element("button", { type: "button", "data-of": of ?? layout }, element("b", {}, name), element("span", {}, words));
          button.addEventListener("click", () => {
            cause = $("cards");
            if (of) return example(of);
            $("layout").value = layout;
            axisRows();
            $("name").value = name;
            build();
            chosen = layout;
            cards();
          });
          return button;
        }),
      );
    for (const button of $("cards").children) button.setAttribute("aria-pressed", String(button.dataset.of === chosen));
    $("example").value = chosen in examples ? chosen : "";
  }

  /** The rows of the axes; values that have been entered stay. */
  function axisRows() {
    const axes = Builder.read($("layout").value);
    const isBad = typeof axes === "string";
    $("layout").setAttribute("aria-invalid", String(isBad));
    $("layout-note").textContent = isBad ? axes : Builder.LAYOUT;
    $("layout-note").classList.toggle("alarm", isBad);
    $("build").disabled = isBad;
    if (!isBad) Builder.fill($("axes").tBodies[0], axes);
  }

  /** The machine file of what has been entered; errors stay as far as it has their axes. */
  function build() {
    keepNow();
    cause = $("build").closest("p");
    problem("");
    const name = JSON.stringify($("name").value || "My machine");
    const rows = [...$("axes").tBodies[0].rows];
    const machine = Builder.machine(name, $("layout").value.trim(), rows, Number($("tool").value));
    const letters = rows.map((row) => row.dataset.letter).concat("S");
    const has = (parameter) => letters.includes(parameter[2] === "0" ? parameter[3] : parameter[2]);
    // What was changed here; the errors of an example are of another machine.
    const own = chosen === null ? entries().filter(([parameter]) => has(parameter)) : [];
    for (const role of ["machine", "errors"]) of(role).forEach((old) => files.delete(old));
    put("machine.toml", encode(machine));
    const lines = own.map(([parameter, value]) => `${parameter} = ${value === 0 ? "0.0" : value.toExponential()}\n`);
    put(ERRORS, encode(`machine = ${name}\n\n[parameters]\n${lines.join("")}`));
    shown = "machine.toml";
    chosen = null;
    changed();
  }

  $("kind").replaceChildren(...Object.entries(Builder.KINDS).map(([words, layout]) => element("option", { value: layout }, words)));
  $("kind").addEventListener("change", () => {
    $("layout").value = $("kind").value;
    axisRows();
  });
  $("layout").addEventListener("input", axisRows);
  $("kind").value = Builder.KINDS["three axes, router"];
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
  for (const id of OPTIONS)
    $(id).addEventListener("change", () => {
      cause = $("options");
      check();
      keep();
    });
  $("tables-switch").addEventListener("click", () => {
    isOn = !stage.wanted;
    stage.act(isOn);
    tell();
    keep();
  });
  // The address is for what has been entered.
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    if (!link) return;
    event.preventDefault();
    document.querySelector(link.getAttribute("href"))?.scrollIntoView();
  });
  const pause = (paused) => {
    stage.pause(paused);
    $("pause").textContent = paused ? "Move" : "Pause";
    $("pause").setAttribute("aria-pressed", String(paused));
  };
  $("pause").addEventListener("click", () => pause(!stage.isPaused));
  pause(stage.isPaused);

  function arcsec(now) {
    inArcsec = now;
    $("in-um").setAttribute("aria-pressed", String(!now));
    $("in-arcsec").setAttribute("aria-pressed", String(now));
    if (known) rows();
    tell();
  }
  $("in-um").addEventListener("click", () => (arcsec(false), keep()));
  $("in-arcsec").addEventListener("click", () => (arcsec(true), keep()));

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
      "This browser cannot reach serial ports; recent versions of Chrome, Edge and Firefox can. Or download the tables and use the command: trueaxis flash.";

  /** The machine that the page opens with, and what the command knows of it. */
  async function begin() {
    const { files: texts, answer } = JSON.parse($("first-model").textContent);
    if (await restore()) return changed();
    for (const [name, text] of Object.entries(texts)) put(name, encode(text));
    chosen = FIRST;
    shown = "machine.toml";
    accept(answer);
    performance.mark("first view");
    changed();
  }

  /** For tests: what was dropped and what was made, and what is drawn. */
  window.trueaxisPage = {
    take,
    files,
    made: () => made,
    stage,
    known: () => known,
    settled: () => compiled === changes || (!problemStays && Boolean($("problem").firstChild)),
  };
  begin();
})();
