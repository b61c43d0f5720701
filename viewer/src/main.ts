import { WallTopo } from "./element/wall_topo";

// The same script runs in the worker.
const inPage = typeof document !== "undefined";
if (inPage && !customElements.get("wall-topo")) customElements.define("wall-topo", WallTopo);
