// The network between a browser and the server, outside of the browser: each engine notices it as on a phone. It ends TLS, because
// WebKit keeps the cookie of a sign-in over HTTPS alone.

import { connect } from "node:net";
import { Transform } from "node:stream";
import { createServer } from "node:tls";

const PORTAL = "<!doctype html><title>Free Wi-Fi</title><h1>Sign in to Free Wi-Fi</h1>";
const ANSWER = `HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: ${PORTAL.length}\r\nConnection: close\r\n\r\n${PORTAL}`;

const BYTES_PER_MS = 50;
const LATENCY_MS = 150;

/** Bytes come late, and only so many in a time. */
function slowly() {
  let free = 0;
  return new Transform({
    transform(piece, _, done) {
      const now = Date.now();
      free = Math.max(free, now) + piece.length / BYTES_PER_MS;
      setTimeout(() => this.push(piece), free - now + LATENCY_MS);
      setTimeout(done, free - now);
    },
    flush(done) {
      setTimeout(done, Math.max(0, free - Date.now()) + 2 * LATENCY_MS);
    },
  });
}

/** Answers pass, but of an event stream nothing after its head. */
function withoutStreams() {
  let isStream = false;
  return new Transform({
    transform(piece, _, done) {
      const end = isStream ? 0 : streamsFrom(piece);
      isStream ||= end >= 0;
      done(null, end < 0 ? piece : piece.subarray(0, end));
    },
  });
}

/** Where the body of an event stream begins in a piece of an answer; -1 without one. */
function streamsFrom(piece) {
  const head = piece.indexOf("text/event-stream");
  const end = head < 0 ? -1 : piece.indexOf("\r\n\r\n", head);
  return end < 0 ? -1 : end + 4;
}

export class Network {
  /**
   * "open"; "cut": connections break; "portal": each request gets the page of a captive portal, with status 200; "slow": 3G, 400 kbit/s
   * and 150 ms each way; "buffering": a proxy that holds streams back, as it does not know their end.
   */
  #mode = "open";
  #sockets = new Set();
  #bytes = Infinity;

  /** Carry what comes to `port` to `target`, ports of this machine. `host`: where to listen; "::1" for IPv6 alone. */
  async listen({ port, target, key, certificate }, host = "127.0.0.1") {
    this.server = createServer({ key, cert: certificate }, (phone) => this.#carry(phone, target));
    await new Promise((resolve) => this.server.listen(port, host, resolve));
    return this;
  }

  set(mode) {
    this.#mode = mode;
    this.#bytes = Infinity;
    for (const socket of this.#sockets) socket.destroy();
  }

  /** Cut it when so many bytes more were sent to the server. */
  cutAfter(bytes) {
    this.#bytes = bytes;
  }

  get isCut() {
    return this.#mode === "cut";
  }

  close() {
    this.set("cut");
    return new Promise((resolve) => this.server.close(resolve));
  }

  #carry(phone, target) {
    if (this.#mode === "cut") return phone.destroy();
    this.#keep(phone);
    if (this.#mode === "portal") return phone.on("data", (text) => text.includes("\r\n\r\n") && phone.end(ANSWER));
    const server = connect(target, "127.0.0.1");
    this.#keep(server);
    phone.on("data", ({ length }) => {
      this.#bytes -= length;
      if (this.#bytes < 0) this.set("cut");
    });
    if (this.#mode === "slow") phone.pipe(slowly()).pipe(server).pipe(slowly()).pipe(phone);
    else if (this.#mode === "buffering") phone.pipe(server).pipe(withoutStreams()).pipe(phone);
    else phone.pipe(server).pipe(phone);
    phone.on("close", () => server.destroy());
    server.on("close", () => phone.destroy());
  }

  #keep(socket) {
    this.#sockets.add(socket);
    socket.setNoDelay(true);
    socket.on("error", () => undefined); // a broken connection is what it is for
    socket.on("close", () => this.#sockets.delete(socket));
  }
}
