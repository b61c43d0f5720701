// The network between a browser and the server, outside of the browser: each engine notices it as on a phone. It ends TLS, because
// WebKit keeps the cookie of a sign-in over HTTPS alone.

import { connect } from "node:net";
import { createServer } from "node:tls";

const PORTAL = "<!doctype html><title>Free Wi-Fi</title><h1>Sign in to Free Wi-Fi</h1>";
const ANSWER = `HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: ${PORTAL.length}\r\nConnection: close\r\n\r\n${PORTAL}`;

export class Network {
  /** "open"; "cut": connections break; "portal": each request gets the page of a captive portal, with status 200. */
  #mode = "open";
  #sockets = new Set();
  #bytes = Infinity;

  /** Carry what comes to `port` to `target`, ports of this machine. */
  async listen({ port, target, key, certificate }) {
    this.server = createServer({ key, cert: certificate }, (phone) => this.#carry(phone, target));
    await new Promise((resolve) => this.server.listen(port, "127.0.0.1", resolve));
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
    phone.pipe(server).pipe(phone);
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
