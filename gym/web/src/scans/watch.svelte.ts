/** Follows a scan by server-sent events. */

import { PREFIX, type Schemas } from "../api/client";

type Facts = Schemas["ScanOut"];

/** Reports each change until the scan stops; returns a function that ends it. */
export function watch(gym: string, scan: string, result: (facts: Facts) => void): () => void {
  const source = new EventSource(`${PREFIX}/gyms/${gym}/scans/${scan}/events`);
  source.onmessage = ({ data }: MessageEvent<string>) => {
    const facts = JSON.parse(data) as Facts;
    // The server ends the stream here; the browser would reconnect.
    if (facts.state !== "queued" && facts.state !== "running") source.close();
    result(facts);
  };
  return () => source.close();
}
