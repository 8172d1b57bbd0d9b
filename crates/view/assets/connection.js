// The WebSocket: JSON text, and binary messages with a header of 16 bytes (kind, channel, frame;
// little-endian).

export const IMAGE = 1, POINTS = 2, MAP = 3;
export const STATE_CHANNEL = 255;

export class Connection {
  // `handlers.text(message)`, `handlers.binary(kind, channel, frame, bytes)`, `handlers.closed(why)`.
  constructor(handlers) {
    this.ended = null;
    this.socket = new WebSocket(`ws://${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        const message = JSON.parse(data);
        if (message.type === "ended") this.ended = message.message;
        handlers.text(message);
        return;
      }
      const header = new DataView(data, 0, 16);
      const frame = Number(header.getBigUint64(8, true));
      handlers.binary(header.getUint32(0, true), header.getUint32(4, true), frame, data.slice(16));
    };
    this.socket.onclose = () =>
      handlers.closed(this.ended ?? "the viewer has ended, or four pages are open already");
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  // The server sends at most two messages of a channel that were not acknowledged.
  acknowledge(channel) {
    this.send({ type: "ack", channel });
  }
}
