/* Runs commands one after the other, away from the page. */
let module = null;
self.onmessage = async ({ data }) => {
  if (data.wasm) {
    module = WebAssembly.compile(data.wasm);
    // A failure is reported by the command that needs it.
    module.catch(() => {});
    return;
  }
  const { id, args, files } = data;
  try {
    const progress = (progress) => self.postMessage({ id, progress });
    const print = (said) => self.postMessage({ id, said });
    const done = await runCommand(await module, args, files, progress, print);
    self.postMessage({ id, done });
  } catch (error) {
    self.postMessage({ id, done: { code: 101, out: "", err: `error: ${error.message}\n`, files: {} } });
  }
};
