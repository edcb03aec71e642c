// The page in a cell of a notebook: messages, pictures and files through the widget's comm. widget.py puts the other
// modules before this one, HTML and CSS as texts, and PART, the bytes of a file in one message.
import { make } from "./debug.js";
import { showPage } from "./page.js";

export default {
  render({ model, el }) {
    const host = make("div"), shadow = host.attachShadow({ mode: "open" });
    shadow.innerHTML = `<style>${CSS}</style>${HTML}`;
    el.append(host);
    // Keys pressed here are no shortcuts of the notebook. JupyterLab looks for them before the page gets them.
    host.dataset.lmSuppressShortcuts = "true";
    for (const kind of ["keydown", "keyup", "keypress"]) host.addEventListener(kind, (event) => event.stopPropagation());

    const page = Math.random().toString(36), requests = new Map(); // a widget that is shown twice has two pages
    let last = 0, receive;
    const post = (message, buffers) => model.send({ page, ...message }, undefined, buffers);
    const request = (message, buffers) => new Promise((resolve, reject) => {
      requests.set(++last, { resolve, reject });
      post({ ...message, id: last }, buffers);
    });
    // One message is under way at a time, so that none queue at a busy kernel. Of those made meanwhile the latest of each
    // kind is sent, with all its changes; keys are all sent.
    let waiting = [], isSending = false;
    async function flush() {
      isSending = true;
      while (waiting.length) {
        const texts = waiting.map((message) => JSON.stringify(message));
        waiting = [];
        await request({ kind: "messages", texts }).catch(() => {});
      }
      isSending = false;
    }
    const link = {
      open({ take, opened }) {
        receive = (message, buffers) => {
          if (message.page !== page) return;
          if (message.kind === "ping") post({ kind: "pong" });
          else if (message.kind === "lost") { isSending = false; join(); } // the kernel took this page for closed
          else if (message.kind !== "reply") take(message, buffers);
          else {
            const { resolve, reject } = requests.get(message.id);
            requests.delete(message.id);
            if (message.error === undefined) resolve({ ...message, buffers }); else reject(new Error(message.error));
          }
        };
        const join = () => { post({ kind: "join" }); opened(); };
        model.on("msg:custom", receive);
        join();
      },
      send(message) {
        const earlier = message.kind === "key" ? undefined : waiting.find(({ kind }) => kind === message.kind);
        if (earlier) Object.assign(earlier, message, message.changes && { changes: { ...earlier.changes, ...message.changes } });
        else waiting.push({ ...message });
        if (!isSending) flush();
      },
      async get(what, query) {
        const { size, file } = await request({ kind: "get", what, query }), parts = [];
        for (let at = 0; at < size; at += PART) parts.push((await request({ kind: "part", file, at })).buffers[0]);
        return new Blob(parts);
      },
      async put(use, file) {
        let upload = null;
        for (let at = 0; at === 0 || at < file.size; at += PART) {
          const part = await file.slice(at, at + PART).arrayBuffer();
          ({ upload } = await request({ kind: "put", use, name: file.name, upload, isLast: at + PART >= file.size }, [part]));
        }
      },
    };
    const leave = () => post({ kind: "leave" });
    window.addEventListener("pagehide", leave);
    const end = showPage(shadow, link);
    return () => {
      end(); leave();
      window.removeEventListener("pagehide", leave);
      model.off("msg:custom", receive);
    };
  },
};
