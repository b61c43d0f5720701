// A phone's connection in front of a server on this machine: so many bits a second each way for all
// connections together, and half of the round trip on each way. Outside of the browser, because a
// browser slows down its pages alone, not their service worker.

import { connect, createServer } from "node:net";

const PIECE_BYTES = 4096;

class Way {
  #free = 0;
  constructor(bits, delay) {
    Object.assign(this, { bits, delay });
  }

  /** Hands pieces on when their last bit would have come; reads on when they have left. */
  join(from, to) {
    // One line for all: timers of their own may overtake each other when the process was busy.
    const waiting = [];
    let timer = null;
    const hand = () => {
      while (waiting.length && waiting[0].time <= performance.now()) waiting.shift().act();
      timer = waiting.length ? setTimeout(hand, Math.max(1, waiting[0].time - performance.now())) : null;
    };
    const after = (time, act) => {
      waiting.push({ time, act });
      timer ??= setTimeout(hand, Math.max(0, time - performance.now()));
    };
    from.on("data", (content) => {
      for (let at = 0; at < content.length; at += PIECE_BYTES) {
        const piece = content.subarray(at, at + PIECE_BYTES);
        this.#free = Math.max(performance.now(), this.#free) + (8e3 * piece.length) / this.bits;
        after(this.#free + this.delay, () => to.writable && to.write(piece));
      }
      from.pause();
      setTimeout(() => from.resume(), Math.max(0, this.#free - performance.now()));
    });
    const last = () => (waiting.length ? waiting.at(-1).time : 0);
    from.on("end", () => after(last(), () => to.end()));
    from.on("error", () => to.destroy());
    from.on("close", () => after(last(), () => to.end()));
  }
}

/** Listens at `port` for what goes to `target`, a port of this machine. */
export function line(port, target, { down, up, roundTrip }) {
  const [there, back] = [new Way(up, roundTrip / 2), new Way(down, roundTrip / 2)];
  const server = createServer((phone) => {
    const far = connect(target, "127.0.0.1");
    for (const socket of [phone, far]) socket.setNoDelay(true);
    there.join(phone, far);
    back.join(far, phone);
  });
  return new Promise((resolve) => server.listen(port, "127.0.0.1", () => resolve(server)));
}
