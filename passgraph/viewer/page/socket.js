// The page on its own: messages through a WebSocket, files through HTTP.
import { showPage } from "./page.js";

const link = {
  open({ take, say, opened }) {
    const url = new URL("socket", location.href);
    url.protocol = "ws:";
    const socket = new WebSocket(url);
    let arriving = null; // a message whose pictures follow
    socket.binaryType = "arraybuffer";
    socket.onopen = opened;
    socket.onclose = () => {
      say("the command has ended, or the connection is lost; trying again");
      setTimeout(() => link.open({ take, say, opened }), 1000);
    };
    socket.onmessage = ({ data }) => {
      if (typeof data !== "string") arriving.data.push(data);
      else {
        const message = JSON.parse(data);
        if (!message.pictures?.length) return take(message);
        arriving = { message, data: [] };
      }
      if (arriving.data.length === arriving.message.pictures.length) take(arriving.message, arriving.data);
    };
    link.socket = socket;
  },
  send: (message) => link.socket.readyState === 1 && link.socket.send(JSON.stringify(message)),
  get: async (what, query) => (await answered(fetch(`${what}?${new URLSearchParams(query)}`))).blob(),
  put: (use, file) => answered(fetch(`${use}/${encodeURIComponent(file.name)}`, { method: "PUT", body: file })),
};

async function answered(request) {
  const response = await request;
  if (!response.ok) throw new Error(await response.text());
  return response;
}

showPage(document, link);
