/* Runs commands one after the other, away from the page. */
let there = {};
/** The command; whoever needs it waits for it, and reports a failure. */
const module = new Promise((resolve, reject) => (there = { resolve, reject }));
module.catch(() => {});

/** The port of the page: what it has received, and who waits for it. `null` bytes: the port is gone. */
const port = {
  received: [],
  isGone: false,
  wake: () => {},

  arrive(bytes) {
    if (bytes) port.received.push(...bytes);
    else port.isGone = true;
    port.wake();
  },

  async read(most, patience) {
    if (!port.received.length && !port.isGone)
      await new Promise((resolve) => {
        port.wake = resolve;
        setTimeout(resolve, patience);
      });
    if (!port.received.length && port.isGone) throw new Error("the port is gone");
    return port.received.splice(0, most);
  },

  async write(bytes) {
    if (port.isGone) throw new Error("the port is gone");
    self.postMessage({ sent: bytes });
  },
};

self.onmessage = async ({ data }) => {
  if (data.module) return there.resolve(data.module);
  if (data.failed) return there.reject(new Error(data.failed));
  if ("arrived" in data) return port.arrive(data.arrived);
  const { id, args, files, isOnPort } = data;
  if (isOnPort) Object.assign(port, { received: [], isGone: false });
  try {
    const progress = (progress) => self.postMessage({ id, progress });
    const print = (said) => self.postMessage({ id, said });
    const done = await runCommand(await module, args, files, progress, print, isOnPort ? port : null);
    self.postMessage({ id, done });
  } catch (error) {
    self.postMessage({ id, done: { code: 101, out: "", err: `error: ${error.message}\n`, files: {} } });
  }
};
