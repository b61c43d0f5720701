/** Follows a scan by server-sent events. */

import { PREFIX, type Schemas } from "../api/client";

type Facts = Schemas["ScanFacts"];

/** Tells each change until nobody works on the scan any more; returns how to stop. */
export function watch(gym: string, scan: string, told: (facts: Facts) => void): () => void {
  const source = new EventSource(`${PREFIX}/gyms/${gym}/scans/${scan}/events`);
  source.onmessage = ({ data }: MessageEvent<string>) => {
    const facts = JSON.parse(data) as Facts;
    // The server ends here; the browser would ask again.
    if (facts.state !== "queued" && facts.state !== "running") source.close();
    told(facts);
  };
  return () => source.close();
}
