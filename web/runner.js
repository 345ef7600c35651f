/* The command in workers. */
const Runner = (() => {
  "use strict";
  const $ = (id) => document.getElementById(id);

  /** The command, compressed in the page; unpacked once the first view is drawn. */
  const wasm = (async () => {
    await new Promise((resolve) => setTimeout(resolve, 30));
    const text = atob($("wasm").textContent.trim());
    const packed = new Uint8Array(text.length);
    for (let k = 0; k < packed.length; k++) packed[k] = text.charCodeAt(k);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return WebAssembly.compile(await new Response(stream).arrayBuffer());
  })();
  // A failure is reported by the command that needs it.
  wasm.catch(() => {});
  const address = URL.createObjectURL(new Blob([$("worker").textContent], { type: "text/javascript" }));

  /** Runs commands one after the other in a worker, which it starts when it is needed. */
  class Runner {
    /** `files()`: those that every command gets; `sent`: takes what it writes to a port. */
    constructor(files, sent) {
      Object.assign(this, { files, sent, worker: null });
      this.waiting = new Map();
      this.calls = 0;
    }

    start() {
      const made = new Worker(address);
      wasm.then(
        (module) => made.postMessage({ module }),
        (error) => made.postMessage({ failed: error.message }),
      );
      made.onmessage = ({ data: { id, progress, said, done, sent } }) => {
        if (sent) return this.sent(sent);
        const call = this.waiting.get(id);
        if (progress !== undefined) call?.progress(progress);
        if (said !== undefined) call?.print(said);
        if (!done) return;
        this.waiting.delete(id);
        call?.resolve(done);
      };
      made.onerror = (event) => {
        const all = [...this.waiting.values()];
        this.waiting.clear();
        this.worker = null;
        for (const { resolve } of all) resolve({ code: 101, out: "", err: `error: ${event.message}\n`, files: {} });
      };
      return made;
    }

    /** Runs a command; files are those that it always gets, and these. `null` if it was cancelled. With a port, it can use it. */
    run(args, more = {}, progress = () => {}, print = () => {}, isOnPort = false) {
      this.worker ??= this.start();
      const id = ++this.calls;
      const inputs = { ...this.files(), ...more };
      return new Promise((resolve) => {
        this.waiting.set(id, { resolve, progress, print });
        this.worker.postMessage({ id, args, files: inputs, isOnPort });
      });
    }

    /** Ends the worker with whatever it is doing. */
    stop() {
      this.worker?.terminate();
      this.worker = null;
      const all = [...this.waiting.values()];
      this.waiting.clear();
      for (const { resolve } of all) resolve(null);
    }
  }

  return Runner;
})();
